// Results of rules that find boxes by grid cells, compared with a scan of all boxes. The worlds are crowded, with boxes
// on the borders of cells, on top of each other, outside the map, and as long as the longest allowed box.
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/common/rng.h"
#include "pictura/tests/simulator/stage.h"

namespace pictura {
namespace {

/// Vehicles around a stadium and beyond the area that its cells cover.
class Crowd : public testing::Stage {
 public:
  Crowd(int num_agents, uint32_t seed)
      : Stage(testing::stadium(300, 2), num_agents), random_({.seed = seed, .purpose = Purpose::town}) {
    const WorldView view = world();
    for (int agent = 0; agent < num_agents; ++agent) {
      const auto i = static_cast<size_t>(agent);
      AgentState& agents = worlds.state.agents;
      const bool is_long = random_.uniform() < 0.2f;
      agents.length_m[i] = is_long ? 6.0f : random_.uniform(0.5f, 5.0f);
      agents.width_m[i] = is_long ? 2.2f : random_.uniform(0.5f, 2.0f);
      agents.status[i] = random_.uniform() < 0.9f ? AgentStatus::active : AgentStatus::absent;
      agents.speed_mps[i] = random_.uniform(0, 20);
      place(view, agent);
    }
    sort_boxes();
  }

  /// Draws a place anywhere, on the border of a cell, at the place of another agent, or far outside.
  Vec2 draw_place() {
    const GridView cells = worlds.box_cells[0].view();
    const float width_m = cells.cell_m * static_cast<float>(cells.num_x);
    const float height_m = cells.cell_m * static_cast<float>(cells.num_y);
    Vec2 p = cells.origin_m + Vec2{random_.uniform(-0.3f, 1.3f) * width_m, random_.uniform(-0.3f, 1.3f) * height_m};
    const float kind = random_.uniform();
    if (kind < 0.2f) p.x = cells.origin_m.x + cells.cell_m * std::floor(random_.uniform(0, 5));
    if (kind > 0.1f && kind < 0.3f) p.y = cells.origin_m.y + cells.cell_m * std::floor(random_.uniform(0, 3));
    if (kind > 0.97f) p = p * 1e3f;
    if (kind > 0.3f && kind < 0.6f) p = middle_ + Vec2{random_.uniform(-20, 20), random_.uniform(-20, 20)};
    if (kind > 0.6f && kind < 0.62f) p = last_;
    last_ = p;
    return p;
  }
  SinCos draw_heading() { return sincos_of(random_.uniform(-3.1f, 3.1f)); }

 private:
  void place(const WorldView& view, int agent) {
    const Vec2 p = draw_place();
    const SinCos heading = draw_heading();
    view.agents.x_m[agent] = p.x;
    view.agents.y_m[agent] = p.y;
    view.agents.cos_heading[agent] = heading.cos;
    view.agents.sin_heading[agent] = heading.sin;
    view.boxes[agent] = view.boxes_before[agent] = box_of(view.agents, agent);
    view.boxes_before[agent].center_m.x -= random_.uniform(-2, 2);
  }

  RandomStream random_;
  Vec2 middle_{150, 20}, last_;
};

constexpr int kCrowdSizes[] = {1, 17, 120, 700, 2500};

TEST(BoxCells, HaveThePartnersOfAllBoxes) {
  for (const int size : kCrowdSizes) {
    Crowd crowd(size, 3);
    const WorldView world = crowd.world();
    const auto box_at = [&](int i) -> const AgentBox& { return world.boxes[i]; };
    for (int agent = 0; agent < size; ++agent) {
      const Vec2 origin{world.agents.x_m[agent], world.agents.y_m[agent]};
      const auto near = nearest_partners(world, agent, origin, SingleThread{});
      const auto all =
          nearest_boxes(world.num_boxes, box_at, [agent](int i) { return i != agent; }, origin, SingleThread{});
      ASSERT_EQ(near.count(), all.count()) << agent << " of " << size;
      for (int i = 0; i < near.count(); ++i) ASSERT_EQ(near.item(i), all.item(i)) << agent << " of " << size;
    }
  }
}

TEST(BoxCells, HaveTheCollisionsOfAllBoxes) {
  int collisions = 0;
  for (const int size : kCrowdSizes) {
    Crowd crowd(size, 4);
    const WorldView world = crowd.world();
    for (int agent = 0; agent < size; ++agent) {
      world.agents.events[agent] = 0;
      find_collisions(world, agent);
      bool collides = false, is_at_fault = false;
      for (int i = 0; i < size && is_active(world, agent); ++i) {
        const AgentBox &own = world.boxes_before[agent], &other = world.boxes_before[i];
        if (i == agent || !world.boxes[i].drawn || !collide(own, world.boxes[agent], other, world.boxes[i])) continue;
        collides = true;
        is_at_fault = is_at_fault || at_fault(own, world.agents.speed_mps[agent], other);
      }
      ASSERT_EQ(world.agents.events[agent],
                (collides ? kEventCollision : kEventNone) | (is_at_fault ? kEventAtFault : kEventNone))
          << agent << " of " << size;
      collisions += collides;
    }
  }
  EXPECT_GT(collisions, 100);
}

TEST(BoxChains, HaveTheBoxesThatBlockAPlace) {
  int clear = 0, blocked = 0;
  for (const int size : kCrowdSizes) {
    Crowd crowd(size, 5);
    const WorldView world = crowd.world();
    for (const int side : {1, 3, 11, 40}) {
      // Cells that cover a part of the map, as many as for a box or a lane, and more.
      std::vector<int32_t> first(static_cast<size_t>(side * side), -1), next(static_cast<size_t>(size), -1);
      const BoxChains chains{
          {{0, -20}, 400.0f / static_cast<float>(side), side, side, {}, {}}, first.data(), next.data()};
      for (int i = 0; i < size; ++i) {
        const Vec2 p = crowd.draw_place();
        const AgentBox box = box_at(AgentClass::vehicle, {4.5f, 1.9f, 1.5f}, {p.x, p.y, 0}, crowd.draw_heading());
        ASSERT_EQ(is_clear(world, box, chains), is_clear(world, box, 0, i)) << i << " of " << size;
        ++(is_clear(world, box, chains) ? clear : blocked);
        if (!world.boxes[i].drawn) continue;
        add_box(chains, i, world.boxes[i].center_m.xy(),
                [](int32_t* value, int32_t other) { return std::exchange(*value, other); });
      }
    }
  }
  EXPECT_GT(clear, 1000);
  EXPECT_GT(blocked, 1000);
}

}  // namespace
}  // namespace pictura
