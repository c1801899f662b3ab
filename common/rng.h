// Counter-based random numbers: Philox4x32-10 (Salmon et al., SC 2011). A draw is a pure function of its key, whatever
// the threads or devices.
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/portable/debug_check.h"
#include "pictura/common/portable/hd.h"

namespace pictura {

struct Philox4 {
  uint32_t word[4];
};

/// Philox4x32 with ten rounds: the block of a counter under a 64-bit key.
PICTURA_HD inline Philox4 philox4x32_10(Philox4 counter, uint32_t key0, uint32_t key1) {
  PICTURA_NO_UNROLL
  for (int round = 0; round < 10; ++round) {
    const uint64_t product0 = uint64_t{0xD2511F53u} * counter.word[0];
    const uint64_t product1 = uint64_t{0xCD9E8D57u} * counter.word[2];
    counter = {{static_cast<uint32_t>(product1 >> 32) ^ counter.word[1] ^ key0, static_cast<uint32_t>(product1),
                static_cast<uint32_t>(product0 >> 32) ^ counter.word[3] ^ key1, static_cast<uint32_t>(product0)}};
    key0 += 0x9E3779B9u;
    key1 += 0xBB67AE85u;
  }
  return counter;
}

/// Purpose of a draw. Runs are reproduced from their seeds, so numbers of purposes must not change.
enum class Purpose : uint8_t {
  world_size = 0,
  spawn = 2,
  agent_class,
  agent_size,
  goals,
  conditioning,
  lights,
  parked_cars,
  walls,
  action,
  initial_state,
  minibatch,
  parameters,
  town,
  soak,
  episode_length,
  map_copies,
  entry,
  removal_case,
  pedestrian_path,
  corner_user,
  driver,
  camera_mounting,
  camera_frame,
  impairment,
  impaired_spell,
};

/// Key of a stream of draws. Unused members are 0.
struct RandomKey {
  static constexpr int kAgentBits = 12, kPurposeBits = 8;  // other fields use all of their bits
  static constexpr uint32_t kMaxAgents = 1u << kAgentBits;

  uint64_t seed = 0;
  uint32_t world = 0;
  uint32_t agent = 0;  // index in the world; not a simulator's slot
  uint32_t episode = 0;
  uint32_t step = 0;
  Purpose purpose = Purpose::world_size;

  PICTURA_HD constexpr bool is_in_range() const { return agent < kMaxAgents; }
};

/// Stream of draws of one key. A debug build checks that the key is in range.
class RandomStream {
 public:
  PICTURA_HD explicit RandomStream(const RandomKey& key)
      : key0_(static_cast<uint32_t>(key.seed)),
        key1_(static_cast<uint32_t>(key.seed >> 32)),
        counter_{
            {key.world,
             (key.agent & (RandomKey::kMaxAgents - 1)) | (static_cast<uint32_t>(key.purpose) << RandomKey::kAgentBits),
             key.episode, key.step}} {
    PICTURA_DEBUG_CHECK(key.is_in_range());
  }

  /// Returns 32 uniform bits. A stream has 16,384 such draws.
  PICTURA_HD uint32_t bits() {
    if (next_ == 4) {
      block_ = philox4x32_10(counter_, key0_, key1_);
      counter_.word[1] += 1u << kBlockShift;
      next_ = 0;
    }
    return block_.word[next_++];
  }

  /// Skips `count` draws of 32 bits.
  PICTURA_HD void skip(int count) {
    for (; count > 0 && next_ < 4; --count) ++next_;
    counter_.word[1] += static_cast<uint32_t>(count / 4) << kBlockShift;
    for (count %= 4; count > 0; --count) bits();
  }

  /// Uniform in [0, 1), 24 bits.
  PICTURA_HD float uniform() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }
  /// Uniform in [low, high).
  PICTURA_HD float uniform(float low, float high) { return low + (high - low) * uniform(); }
  /// Uniform in {0, ..., n - 1}, n >= 1, with a bias below n / 2^32.
  PICTURA_HD int below(int n) { return static_cast<int>((uint64_t{bits()} * static_cast<uint32_t>(n)) >> 32); }

 private:
  static constexpr int kBlockShift = RandomKey::kAgentBits + RandomKey::kPurposeBits;
  uint32_t key0_, key1_;
  Philox4 counter_;
  Philox4 block_{};
  int next_ = 4;
};

}  // namespace pictura
