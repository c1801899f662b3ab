#include "pictura/map/procedural/movements.h"

namespace pictura::town {

namespace {

/// The movements of those who arrive on one arm.
class Approach {
 public:
  Approach(const Layout& layout, const Node& node, int arm)
      : layout_(layout), node_(node), arm_(arm), in_(lanes_of(arm)), has_slip_(layout.has_slip(node.arm(arm))) {}

  std::vector<Movement> movements() {
    const int straight = straight_on(node_, arm_);
    if (straight >= 0) {
      go_straight(straight);
    } else {
      part_left_and_right();
    }
    if (has_slip_) {
      const int exit = arm_at(1);
      found_.push_back({arm_, exit, 0, lanes_of(exit) - 1, 1, true});
    }
    return found_;
  }

 private:
  int lanes_of(int arm) const { return layout_.streets()[node_.arm(arm).street].lanes; }
  /// The exits, from 1, the one to the right, to degree - 1, the one to the left.
  int arm_at(int exit) const { return (arm_ + exit) % node_.degree(); }
  void add(int to, int first_in, int first_out, int lanes) { found_.push_back({arm_, to, first_in, first_out, lanes}); }

  /// Whether nobody goes straight on into this arm, so that turns alone must fill its lanes.
  bool is_stem(int arm) const { return straight_on(node_, arm) < 0; }

  /// All lanes go straight on, the innermost also left and the outermost also right. None crosses another: of a stem
  /// that they turn into they choose the lane.
  void go_straight(int straight) {
    add(straight, 0, 0, in_);
    bool is_left = false;
    for (int exit = 1; exit < node_.degree(); ++exit) {
      const int to = arm_at(exit);
      const int last = lanes_of(to) - 1;
      if (to == straight) {
        is_left = true;
      } else if (is_left) {
        for (int lane = 0; lane < (is_stem(to) ? num_left(last + 1) : 1); ++lane) add(to, 0, lane, 1);
      } else if (exit > 1 || !has_slip_) {
        for (int lane = is_stem(to) ? first_right(last + 1) : last; lane <= last; ++lane) add(to, in_ - 1, lane, 1);
      }
    }
  }

  /// From the stem of a T, or an arm between two others.
  void part_left_and_right() {
    const int left = arm_at(node_.degree() - 1), right = arm_at(1);
    const int to_left = std::min(lanes_of(left), num_left(in_));
    add(left, 0, 0, to_left);
    for (int exit = 2; exit < node_.degree() - 1; ++exit) {
      const int to = arm_at(exit);
      const bool turns_right = wrapped(node_.arm(to).heading - node_.arm(arm_).heading - kPi_rad) < 0;
      add(to, to_left - 1, turns_right ? lanes_of(to) - 1 : 0, 1);
    }
    if (has_slip_) return;
    const int to_right = std::min(lanes_of(right), in_ - first_right(in_));
    add(right, in_ - to_right, lanes_of(right) - to_right, to_right);
  }

  // Of a stem's lanes, one belongs to the traffic of both sides: those inside it to the left, those outside to the
  // right.
  static int num_left(int lanes) { return (lanes + 1) / 2; }
  static int first_right(int lanes) { return num_left(lanes) - 1; }

  const Layout& layout_;
  const Node& node_;
  int arm_, in_;
  bool has_slip_;
  std::vector<Movement> found_;
};

}  // namespace

int straight_on(const Node& node, int arm) {
  for (int i = 0; i < node.degree(); ++i) {
    if (node.arm(i).direction == opposite(node.arm(arm).direction)) return i;
  }
  return -1;
}

std::vector<Movement> movements_of(const Layout& layout, const Node& node) {
  std::vector<Movement> all;
  for (int arm = 0; arm < node.degree(); ++arm) {
    for (const Movement& movement : Approach(layout, node, arm).movements()) all.push_back(movement);
  }
  return all;
}

}  // namespace pictura::town
