// Heights of crossings: gentle hills, clearance at overpasses, limited grades.
#include <cmath>

#include "pictura/map/procedural/elevation.h"
#include "pictura/map/procedural/layout.h"

namespace pictura::town {

namespace {

constexpr double kClearance_m = 5.5;  // between the surfaces of an overpass
constexpr int kSweeps = 2000;

}  // namespace

void Layout::set_heights() {
  // Sum of three waves, between 0 and hills_m.
  constexpr int kWaves = 3;
  struct Wave {
    Eigen::Vector2d number{0, 0};  // radians per metre along both axes
    double phase = 0;
  } waves[kWaves];
  for (int i = 0; i < kWaves; ++i) {
    RandomStream stream = draw(kHills, i);
    const double direction = static_cast<double>(stream.uniform()) * 2 * kPi_rad;
    const double wavenumber = 2 * kPi_rad / static_cast<double>(stream.uniform(200, 600));
    waves[i] = {wavenumber * direction_of(direction), static_cast<double>(stream.uniform()) * 2 * kPi_rad};
  }
  for (Node& node : nodes_) {
    double sum = 0;
    for (const Wave& wave : waves) sum += std::sin(wave.number.dot(node.position_m) + wave.phase);
    node.z = node.upper_z = options_.hills_m * 0.5 * (1 + sum / kWaves);
  }
  // Relaxation: repeats until all constraints hold. Each sweep moves the ends of streets that are too steep towards
  // each other, and the streets of overpasses apart.
  const auto height = [&](int n, const Street& street) -> double& {
    const bool is_upper =
        nodes_[n].kind == NodeKind::overpass && (street.direction % 4 == 2) == nodes_[n].upper_runs_north;
    return is_upper ? nodes_[n].upper_z : nodes_[n].z;
  };
  bool converged = false;
  for (int sweep = 0; sweep < kSweeps && !converged; ++sweep) {
    converged = true;
    for (Node& node : nodes_) {
      if (node.kind != NodeKind::overpass) continue;
      const double missing = kClearance_m - (node.upper_z - node.z);
      node.upper_z += 0.5 * missing;
      node.z -= 0.5 * missing;
    }
    for (const Street& street : streets_) {
      double &from = height(street.from, street), &to = height(street.to, street);
      const double excess = std::abs(to - from) - max_climb_m(street.length_m);
      if (excess <= 1e-9) continue;
      converged = false;
      from += std::copysign(0.5 * excess, to - from);
      to += std::copysign(0.5 * excess, from - to);
    }
  }
  for (Node& node : nodes_) {
    if (node.kind != NodeKind::overpass) node.upper_z = node.z;
  }
}

}  // namespace pictura::town
