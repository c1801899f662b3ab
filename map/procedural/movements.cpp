#include "pictura/map/procedural/movements.h"

namespace pictura::town {

namespace {

/// Movements of traffic that arrives on one arm.
class Approach {
 public:
  Approach(const Layout& layout, const Node& node, int arm)
      : layout_(layout), node_(node), arm_(arm), in_(lanes_of(arm)), has_slip_(layout.has_slip(node.arm(arm))) {}

  std::vector<Movement> movements() {
    const int straight = straight_on(node_, arm_);
    if (node_.kind == NodeKind::fork) {
      pass_fork(straight);
    } else if (straight >= 0) {
      go_straight(straight);
    } else {
      split_left_and_right();
    }
    if (has_slip_) {
      const int exit = arm_at(1);
      movements_.push_back({arm_, exit, 0, lanes_of(exit) - 1, 1, true});
    }
    return movements_;
  }

 private:
  int lanes_of(int arm) const { return layout_.streets()[node_.arm(arm).street].lanes; }
  /// Returns the arm of an exit. Exits count counter-clockwise from the right: exit 1 is on the right, exit degree - 1
  /// on the left.
  int arm_at(int exit) const { return (arm_ + exit) % node_.degree(); }
  bool may_leave(int arm) const { return node_.arm(arm).has_departures; }
  void add(int to, int first_in, int first_out, int lanes) {
    movements_.push_back({arm_, to, first_in, first_out, lanes});
  }

  /// Whether no traffic goes straight on into this arm, so that only turns use its lanes.
  bool is_stem(int arm) const { return straight_on(node_, arm) < 0; }

  /// Sends all lanes straight on. The innermost lane also turns left, and the outermost lane also turns right. Paths do
  /// not cross. A turn into a stem may use any lane on its side of the stem.
  void go_straight(int straight) {
    add(straight, 0, 0, std::min(in_, lanes_of(straight)));
    bool is_left = false;
    for (int exit = 1; exit < node_.degree(); ++exit) {
      const int to = arm_at(exit);
      const int last = lanes_of(to) - 1;
      if (to == straight) {
        is_left = true;
      } else if (!may_leave(to)) {
        continue;
      } else if (is_left) {
        for (int lane = 0; lane < (is_stem(to) ? num_left(last + 1) : 1); ++lane) add(to, 0, lane, 1);
      } else if (exit > 1 || !has_slip_) {
        for (int lane = is_stem(to) ? first_right(last + 1) : last; lane <= last; ++lane) add(to, in_ - 1, lane, 1);
      }
    }
  }

  /// Splits the lanes into left and right turns, for the stem of a T or an arm without an opposite arm.
  void split_left_and_right() {
    const int left = arm_at(node_.degree() - 1), right = arm_at(1);
    const int to_left = std::min(lanes_of(left), num_left(in_));
    if (may_leave(left)) add(left, 0, 0, to_left);
    for (int exit = 2; exit < node_.degree() - 1; ++exit) {
      const int to = arm_at(exit);
      const bool turns_right = wrap_to_pi(node_.arm(to).heading - node_.arm(arm_).heading - kPi_rad) < 0;
      add(to, to_left - 1, turns_right ? lanes_of(to) - 1 : 0, 1);
    }
    if (has_slip_ || !may_leave(right)) return;
    const int to_right = std::min(lanes_of(right), in_ - first_right(in_));
    add(right, in_ - to_right, lanes_of(right) - to_right, to_right);
  }

  /// Continues the lanes that the motorway has on both sides of the fork. An additional lane before the fork becomes
  /// the ramp on its right. A ramp becomes the outermost lane of the arm on its right.
  void pass_fork(int straight) {
    const int right = arm_at(1);
    if (straight < 0) return add(right, 0, lanes_of(right) - 1, 1);
    const int out = lanes_of(straight);
    add(straight, 0, 0, std::min(in_, out));
    if (in_ > out) add(right, out, 0, 1);
  }

  // The middle lane of a stem serves both turns. Lanes on its left serve only left turns, and lanes on its right only
  // right turns.
  static int num_left(int lanes) { return (lanes + 1) / 2; }
  static int first_right(int lanes) { return num_left(lanes) - 1; }

  const Layout& layout_;
  const Node& node_;
  int arm_, in_;
  bool has_slip_;
  std::vector<Movement> movements_;
};

}  // namespace

int straight_on(const Node& node, int arm) {
  for (int i = 0; i < node.degree(); ++i) {
    if (node.arm(i).direction == opposite(node.arm(arm).direction) && node.arm(i).has_departures) return i;
  }
  return -1;
}

std::vector<Movement> movements_of(const Layout& layout, const Node& node) {
  std::vector<Movement> all;
  for (int arm = 0; arm < node.degree(); ++arm) {
    if (!node.arm(arm).has_arrivals) continue;
    for (const Movement& movement : Approach(layout, node, arm).movements()) all.push_back(movement);
  }
  return all;
}

}  // namespace pictura::town
