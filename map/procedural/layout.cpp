// Selects the crossings, streets and features of a town.
#include "pictura/map/procedural/layout.h"

#include <cmath>
#include <numeric>

namespace pictura::town {

namespace {

// Usual lane width, variation of block lengths as a fraction of their mean, and variation of each coordinate of nodes.
constexpr double kUsualLaneWidth_m = 3.5;
constexpr double kSpacingSpread = 0.12, kJitter_m = 3.5;

}  // namespace

Layout::Layout(const TownOptions& options) : options_(options) {
  const float spread = draw(kLaneWidth, 0).uniform(-1, 1);
  lane_width_m_ = kUsualLaneWidth_m + options_.lane_spread_m * static_cast<double>(spread);
  place_nodes();
  plan_streets();
  choose_avenues();
  choose_overpasses();
  add_motorway();
  choose_roundabouts();
  add_diagonals();
  remove_streets();
  choose_street_features();
  join_streets();
  set_headings();
  curve_streets();
  remove_large_roundabouts();
  choose_crossing_features();
  choose_slip_lanes();
  build_curves();
  set_heights();
}

std::vector<int> Layout::shuffled(std::vector<int> candidates, uint32_t purpose) const {
  std::vector<std::pair<uint32_t, int>> order;
  for (const int candidate : candidates) order.emplace_back(draw(purpose, candidate).bits(), candidate);
  std::sort(order.begin(), order.end());
  for (std::size_t i = 0; i < order.size(); ++i) candidates[i] = order[i].second;
  return candidates;
}

std::vector<int> Layout::pick(double fraction, std::vector<int> candidates, uint32_t purpose) const {
  const double count = std::ceil(fraction * static_cast<double>(candidates.size()) - 1e-9);
  candidates = shuffled(std::move(candidates), purpose);
  candidates.resize(count);
  return candidates;
}

void Layout::place_nodes() {
  const auto positions = [&](int blocks, int axis) {
    RandomStream stream = draw(kSpacing, axis);
    std::vector<double> at(1, 0.0);
    for (int i = 0; i < blocks; ++i) {
      const float spread = stream.uniform(-1, 1);
      at.push_back(at.back() + options_.block_m * (1 + kSpacingSpread * static_cast<double>(spread)));
    }
    for (double& position : at) position -= 0.5 * at.back();
    return at;
  };
  const std::vector<double> columns = positions(options_.blocks_x, 0), rows = positions(options_.blocks_y, 1);
  for (int j = 0; j <= options_.blocks_y; ++j) {
    for (int i = 0; i <= options_.blocks_x; ++i) {
      RandomStream jitter = draw(kJitter, static_cast<int>(nodes_.size()));
      Node node;
      node.position_m.x() = columns[i] + kJitter_m * static_cast<double>(jitter.uniform(-1, 1));
      node.position_m.y() = rows[j] + kJitter_m * static_cast<double>(jitter.uniform(-1, 1));
      node.on_border = i == 0 || j == 0 || i == options_.blocks_x || j == options_.blocks_y;
      nodes_.push_back(node);
    }
  }
}

Street& Layout::add_street(int from, int to, int direction) {
  Street& street = streets_.emplace_back();
  street.from = from;
  street.to = to;
  street.direction = direction;
  street.end_direction = opposite(direction);
  street.lane_width_m = lane_width_m_;
  return street;
}

void Layout::plan_streets() {
  for (int j = 0; j <= options_.blocks_y; ++j) {
    for (int i = 0; i <= options_.blocks_x; ++i) {
      if (i < options_.blocks_x) add_street(node_at(i, j), node_at(i + 1, j), 0);
      if (j < options_.blocks_y) add_street(node_at(i, j), node_at(i, j + 1), 2);
    }
  }
}

/// Chooses avenues: the border, and whole rows and columns inside it.
void Layout::choose_avenues() {
  has_ring_road_ = draw(kRingRoad, 0).uniform() < static_cast<float>(options_.ring_road) && options_.max_lanes > 1;
  // An avenue ends at the border, where half of its lanes turn left and half turn right. So without a ring road it has
  // at most two lanes per direction.
  const auto lanes_of = [&](int line) {
    const int max_lanes = static_cast<int>(has_ring_road_ ? options_.max_lanes : std::min(options_.max_lanes, 2.0));
    return 2 + draw(kAvenueLanes, line).below(max_lanes - 1);
  };
  std::vector<int> lines;  // row indices, and kMaxTownBlocks plus column indices
  for (int j = 1; j < options_.blocks_y; ++j) lines.push_back(j);
  for (int i = 1; i < options_.blocks_x; ++i) lines.push_back(kMaxTownBlocks + i);
  if (options_.max_lanes < 2) lines.clear();
  lines = pick(options_.avenues, lines, kAvenues);
  const auto widen = [](Street* street, int lanes) {
    street->kind = StreetKind::avenue;
    street->lanes = lanes;
  };
  for (Street& street : streets_) {
    const int row = street.from / (options_.blocks_x + 1), column = street.from % (options_.blocks_x + 1);
    const int line = street.direction == 0 ? row : kMaxTownBlocks + column;
    const bool on_border =
        street.direction == 0 ? row == 0 || row == options_.blocks_y : column == 0 || column == options_.blocks_x;
    if (on_border && has_ring_road_) widen(&street, lanes_of(0));
    if (!on_border && std::find(lines.begin(), lines.end(), line) != lines.end()) widen(&street, lanes_of(line));
  }
}

/// Chooses inner nodes for overpasses, nodes on avenues first. No two overpasses are adjacent, so that each rise can
/// use a whole street.
void Layout::choose_overpasses() {
  std::vector<int> inner;
  for (int n = 0; n < static_cast<int>(nodes_.size()); ++n) {
    if (!nodes_[n].on_border) inner.push_back(n);
  }
  const auto wanted = static_cast<std::ptrdiff_t>(pick(options_.overpasses, inner, kOverpasses).size());
  std::ptrdiff_t count = 0;
  inner = shuffled(std::move(inner), kOverpasses);
  std::stable_partition(inner.begin(), inner.end(), [&](int n) { return max_lanes_at(n) > 1; });
  for (const int n : inner) {
    if (count == wanted) break;
    const int column = n % (options_.blocks_x + 1), row = n / (options_.blocks_x + 1);
    bool has_neighbor = false;
    for (int direction = 0; direction < kNumDirections; ++direction) {
      const int other = node_at(column + kStepX[direction], row + kStepY[direction]);
      has_neighbor = has_neighbor || nodes_[other].kind == NodeKind::overpass;
    }
    if (has_neighbor) continue;
    nodes_[n].kind = NodeKind::overpass;
    nodes_[n].upper_runs_north = draw(kUpperStreet, n).below(2) == 1;
    ++count;
  }
}

std::vector<int> Layout::streets_at(int node) const {
  std::vector<int> found;
  for (int s = 0; s < static_cast<int>(streets_.size()); ++s) {
    if (streets_[s].is_present && (streets_[s].from == node || streets_[s].to == node)) found.push_back(s);
  }
  return found;
}

int Layout::max_lanes_at(int node) const {
  int lanes = 0;
  for (const int street : streets_at(node)) lanes = std::max(lanes, streets_[street].lanes);
  return lanes;
}

bool Layout::has_ramps(int node) const {
  const std::vector<int> at = streets_at(node);
  return std::any_of(at.begin(), at.end(), [this](int street) { return streets_[street].kind == StreetKind::ramp; });
}

void Layout::choose_roundabouts() {
  std::vector<int> candidates;
  for (int n = 0; n < static_cast<int>(nodes_.size()); ++n) {
    if (nodes_[n].kind == NodeKind::crossing && streets_at(n).size() > 2 &&
        max_lanes_at(n) <= options_.roundabout_lanes && !has_ramps(n)) {
      candidates.push_back(n);
    }
  }
  for (const int n : pick(options_.roundabouts, candidates, kRoundabouts)) nodes_[n].kind = NodeKind::roundabout;
}

/// Adds fifth arms: streets through a block to the diagonally opposite node.
void Layout::add_diagonals() {
  std::vector<char> block_is_cut(static_cast<std::size_t>(options_.blocks_x * options_.blocks_y), 0);
  std::vector<char> has_diagonal(nodes_.size(), 0);
  const auto cut = [&](int node, int direction) {
    const int column = node % (options_.blocks_x + 1), row = node / (options_.blocks_x + 1);
    const int to_column = column + kStepX[direction], to_row = row + kStepY[direction];
    const int to = node_at(to_column, to_row);
    char& is_cut = block_is_cut[std::min(row, to_row) * options_.blocks_x + std::min(column, to_column)];
    if (is_cut || has_diagonal[node] || has_diagonal[to] || nodes_[to].kind != NodeKind::crossing ||
        streets_at(to).size() < 3) {
      return false;
    }
    add_street(node, to, direction);
    is_cut = has_diagonal[node] = has_diagonal[to] = 1;
    return true;
  };
  // Without a diagonal, traffic around a single block could only circle.
  if (nodes_.size() == 4) {
    add_street(0, 3, 1);
    return;
  }
  std::vector<int> candidates;
  for (int n = 0; n < static_cast<int>(nodes_.size()); ++n) {
    if (!nodes_[n].on_border && nodes_[n].kind == NodeKind::crossing && max_lanes_at(n) == 1) candidates.push_back(n);
  }
  for (const int n : pick(options_.five_arms, candidates, kFiveArms)) {
    for (const int direction : shuffled({1, 3, 5, 7}, kDiagonals + 1000u * static_cast<uint32_t>(n + 1))) {
      if (cut(n, direction)) break;
    }
  }
}

/// Whether the remaining streets connect all nodes. At an overpass, streets are connected only with the opposite
/// street.
bool Layout::is_connected() const {
  // Union-find over two elements per node. The elements of an overpass are its eastward and its northward street. Other
  // nodes use only the first element.
  std::vector<int> parent(2 * nodes_.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto half = [&](int node, int direction) {
    return 2 * node + (nodes_[node].kind == NodeKind::overpass && direction % 4 == 2 ? 1 : 0);
  };
  for (const Street& street : streets_) {
    if (street.is_present) parent[root(half(street.from, street.direction))] = root(half(street.to, street.direction));
  }
  for (int n = 0; n < static_cast<int>(nodes_.size()); ++n) {
    if (root(2 * n) != root(0)) return false;
    if (nodes_[n].kind == NodeKind::overpass && root(2 * n + 1) != root(0)) return false;
  }
  return true;
}

/// Whether a street may be removed: no dead end results, and both nodes keep the streets that their kind needs.
bool Layout::is_removable(int s) const {
  const Street& street = streets_[s];
  if (street.kind != StreetKind::street || street.direction % 2 == 1) return false;
  for (const int node : {street.from, street.to}) {
    const std::vector<int> at = streets_at(node);
    if (nodes_[node].kind == NodeKind::overpass || at.size() < 3) return false;
    if (nodes_[node].kind == NodeKind::roundabout && at.size() < 4) return false;
    std::vector<int> lanes;
    for (const int other : at) {
      if (streets_[other].direction % 2 == 1) return false;  // a fifth arm stays a fifth arm
      if (other != s) lanes.push_back(streets_[other].lanes);
    }
    if (lanes.size() == 2 && lanes[0] != lanes[1]) return false;
  }
  return true;
}

void Layout::remove_streets() {
  std::vector<int> candidates;
  for (int s = 0; s < static_cast<int>(streets_.size()); ++s) {
    if (is_removable(s)) candidates.push_back(s);
  }
  auto wanted = std::lround((1 - options_.density) * static_cast<double>(candidates.size()));
  const auto num_forks = [&] {
    std::vector<int> degrees(nodes_.size(), 0);
    for (const Street& street : streets_) {
      degrees[street.from] += street.is_present ? 1 : 0;
      degrees[street.to] += street.is_present ? 1 : 0;
    }
    int forks = 0;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      forks += nodes_[n].kind != NodeKind::overpass && degrees[n] > 2 ? 1 : 0;
    }
    return forks;
  };
  for (const int s : shuffled(candidates, kThinning)) {
    if (wanted == 0) break;
    if (!is_removable(s)) continue;
    streets_[s].is_present = false;
    if (is_connected() && num_forks() > 0) {
      --wanted;
    } else {
      streets_[s].is_present = true;
    }
  }
  std::erase_if(streets_, [](const Street& street) { return !street.is_present; });
}

void Layout::choose_street_features() {
  std::vector<int> all, sides;  // a side is twice the street index, plus one for the left side
  for (int s = 0; s < static_cast<int>(streets_.size()); ++s) {
    streets_[s].has_sidewalks = false;
    if (streets_[s].kind == StreetKind::ramp || streets_[s].kind == StreetKind::motorway) continue;
    all.push_back(s);
    if (streets_[s].lanes > 1 || streets_[s].kind == StreetKind::connector) continue;
    sides.push_back(2 * s);
    sides.push_back(2 * s + 1);
  }
  for (const int s : pick(options_.sidewalks, all, kSidewalks)) streets_[s].has_sidewalks = true;
  for (const int side : pick(options_.parking, sides, kParking)) {
    (side % 2 == 1 ? streets_[side / 2].parks_left : streets_[side / 2].parks_right) = true;
  }
}

void Layout::join_streets() {
  for (int s = 0; s < static_cast<int>(streets_.size()); ++s) {
    const bool is_two_way = streets_[s].kind != StreetKind::ramp;
    nodes_[streets_[s].from].arms.push_back({s, streets_[s].direction, true, is_two_way, true});
    nodes_[streets_[s].to].arms.push_back({s, streets_[s].end_direction, false, true, is_two_way});
  }
  for (Node& node : nodes_) {
    std::sort(node.arms.begin(), node.arms.end(), [](const Arm& a, const Arm& b) { return a.direction < b.direction; });
  }
}

void Layout::choose_crossing_features() {
  std::vector<int> crossings, with_crosswalks;
  for (int n = 0; n < static_cast<int>(nodes_.size()); ++n) {
    if (nodes_[n].is_crossing()) crossings.push_back(n);
    if ((nodes_[n].is_crossing() && !has_ramps(n)) || nodes_[n].kind == NodeKind::roundabout)
      with_crosswalks.push_back(n);
  }
  const std::vector<int> lit = pick(options_.lights, crossings, kLights);
  for (const int n : lit) nodes_[n].has_lights = true;
  for (const int n : pick(options_.far_side, lit, kFarSide)) nodes_[n].far_side_heads = true;
  for (const int n : pick(options_.crosswalks, with_crosswalks, kCrosswalks)) nodes_[n].has_crosswalks = true;
}

double Layout::end_height_m(int street, bool at_start) const {
  const Street& s = streets_[street];
  const Node& node = nodes_[at_start ? s.from : s.to];
  const bool runs_north = s.direction % 4 == 2;
  return node.kind == NodeKind::overpass && runs_north == node.upper_runs_north ? node.upper_z : node.z;
}

int Layout::max_lanes_of(const Node& node) const {
  int lanes = 1;
  for (const Arm& arm : node.arms) lanes = std::max(lanes, streets_[arm.street].lanes);
  return lanes;
}

bool Layout::has_slip(const Arm& arm) const {
  const Street& street = streets_[arm.street];
  return arm.at_start ? street.slip_at_start : street.slip_at_end;
}

}  // namespace pictura::town
