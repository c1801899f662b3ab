// pictura's Philox compared with that of the Random123 library, and properties of random streams.
#include "pictura/common/rng.h"

#include <set>

#include <Random123/philox.h>
#include <gtest/gtest.h>

namespace pictura {
namespace {

TEST(Rng, PhiloxEqualsRandom123) {
  for (uint32_t i = 0; i < 100; ++i) {
    const Philox4 counter{{i * 7u, ~i, i << 16, 0x243F6A88u ^ i}};
    const uint32_t key0 = i * 0x9E3779B9u, key1 = 0xA4093822u + i;
    r123::Philox4x32::ctr_type reference_counter{{counter.word[0], counter.word[1], counter.word[2], counter.word[3]}};
    r123::Philox4x32::key_type reference_key{{key0, key1}};
    const auto reference = r123::Philox4x32()(reference_counter, reference_key);
    const Philox4 ours = philox4x32_10(counter, key0, key1);
    for (size_t w = 0; w < 4; ++w) ASSERT_EQ(ours.word[w], reference[w]);
  }
}

TEST(Rng, StreamsOfDifferentKeysDiffer) {
  std::set<uint32_t> first_draws;
  for (uint64_t seed : {0ull, 1ull, 1ull << 32}) {
    for (uint32_t world : {0u, 1u}) {
      for (uint32_t agent : {0u, 1u, 4095u}) {
        for (uint32_t episode : {0u, 1u}) {
          for (uint32_t step : {0u, 1u}) {
            for (Purpose purpose : {Purpose::world_size, Purpose::spawn, Purpose::action}) {
              first_draws.insert(RandomStream({.seed = seed,
                                               .world = world,
                                               .agent = agent,
                                               .episode = episode,
                                               .step = step,
                                               .purpose = purpose})
                                     .bits());
            }
          }
        }
      }
    }
  }
  EXPECT_EQ(first_draws.size(), 3u * 2 * 3 * 2 * 2 * 3);
}

TEST(Rng, KeysBeyondTheirFieldsAreRefused) {
  EXPECT_TRUE((RandomKey{.agent = 4095, .purpose = Purpose::soak}.is_in_range()));
  EXPECT_FALSE((RandomKey{.agent = 4096}.is_in_range()));
  // Such a key would have the draws of agent 0.
  EXPECT_DEBUG_DEATH(RandomStream({.agent = 4096}), "is_in_range");
}

TEST(Rng, AStreamRepeatsAndDoesNotCycleBetweenBlocks) {
  RandomStream a({.seed = 5, .world = 1, .agent = 2, .episode = 3, .step = 4, .purpose = Purpose::goals}),
      b({.seed = 5, .world = 1, .agent = 2, .episode = 3, .step = 4, .purpose = Purpose::goals});
  std::set<uint32_t> seen;
  for (int i = 0; i < 1000; ++i) {
    const uint32_t bits = a.bits();
    ASSERT_EQ(bits, b.bits());
    seen.insert(bits);
  }
  EXPECT_GE(seen.size(), 999u);
}

TEST(Rng, UniformDrawsHaveTheMomentsOfTheirRange) {
  RandomStream random({.seed = 1, .purpose = Purpose::spawn});
  double sum = 0, sum_squares = 0;
  std::array<int, 7> histogram{};
  constexpr int kDraws = 8000;
  for (int i = 0; i < kDraws; ++i) {
    const float u = random.uniform(2.0f, 12.0f);
    ASSERT_GE(u, 2.0f);
    ASSERT_LT(u, 12.0f);
    sum += u;
    sum_squares += double{u} * u;
    ++histogram[random.below(7)];
  }
  const double mean = sum / kDraws, variance = sum_squares / kDraws - mean * mean;
  EXPECT_NEAR(mean, 7.0, 0.13);  // 4 standard errors of sqrt(100 / 12 / 8000)
  EXPECT_NEAR(variance, 100.0 / 12.0, 0.4);
  for (const int count : histogram) EXPECT_NEAR(count, kDraws / 7.0, 130);
}

}  // namespace
}  // namespace pictura
