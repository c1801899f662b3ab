#include "pictura/replay/images.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>

#include <zlib.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

// Arithmetic coder of LZMA (Pavlov's specification of 2015) with finer probabilities. The encoder holds back bytes that
// a carry may still change: one byte, and the 0xFF bytes after it.

/// Probability that a bit is 0, in units of 1/32768, and the number of bits seen, up to 15.
struct BitModel {
  uint16_t zero = 16384;
  uint8_t seen = 0;

  void learn(int bit) {
    // The probability is an average of the first few bits. Later it is an exponential moving average.
    constexpr uint8_t kShift[] = {1, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5};
    const int shift = kShift[std::min<int>(seen, 15)];
    if (seen < 15) ++seen;
    zero = static_cast<uint16_t>(bit ? zero - (zero >> shift) : zero + ((32768 - zero) >> shift));
    zero = static_cast<uint16_t>(std::clamp<int>(zero, 32, 32736));
  }
};
constexpr int kChanceBits = 15;
constexpr uint32_t kLeastRange = 1u << 24;

class Encoder {
 public:
  int bit(BitModel* chance, int value) {
    const uint32_t bound = (range_ >> kChanceBits) * chance->zero;
    if (value == 0) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    chance->learn(value);
    for (; range_ < kLeastRange; range_ <<= 8) shift_low();
    return value;
  }
  std::string finish() {
    for (int i = 0; i < 5; ++i) shift_low();
    return std::move(bytes_);
  }

 private:
  void shift_low() {
    if (low_ < 0xFF000000u || low_ > 0xFFFFFFFFu) {
      const auto carry = static_cast<uint8_t>(low_ >> 32);
      bytes_.push_back(static_cast<char>(first_ + carry));
      for (; held_ > 1; --held_) bytes_.push_back(static_cast<char>(0xFF + carry));
      held_ = 0;
      first_ = static_cast<uint8_t>(low_ >> 24);
    }
    ++held_;
    low_ = (low_ & 0x00FFFFFFu) << 8;
  }

  uint64_t low_ = 0;
  uint32_t range_ = 0xFFFFFFFFu;
  // Bytes that a carry may still change: `first_`, and `held_ - 1` bytes 0xFF after it. At the start, `first_` is an
  // additional byte before all others.
  uint8_t first_ = 0;
  size_t held_ = 1;
  std::string bytes_;
};

class Decoder {
 public:
  explicit Decoder(std::string_view bytes) : bytes_(bytes) {
    for (int i = 0; i < 5; ++i) code_ = code_ << 8 | next();  // the first byte is always 0
  }
  int bit(BitModel* chance, int /*value*/) {
    const uint32_t bound = (range_ >> kChanceBits) * chance->zero;
    const int value = code_ < bound ? 0 : 1;
    if (value == 0) {
      range_ = bound;
    } else {
      code_ -= bound;
      range_ -= bound;
    }
    chance->learn(value);
    for (; range_ < kLeastRange; range_ <<= 8) code_ = code_ << 8 | next();
    return value;
  }

 private:
  uint8_t next() {
    PICTURA_CHECK(at_ < bytes_.size(), "images: a group is truncated after {} bytes", bytes_.size());
    return static_cast<uint8_t>(bytes_[at_++]);
  }

  std::string_view bytes_;
  size_t at_ = 0;
  uint32_t code_ = 0, range_ = 0xFFFFFFFFu;
};

/// Codes a number of `bits` bits, the highest bit first. The probability of each bit depends on the previous bits.
template <typename Coder>
int code_number(Coder* coder, BitModel* tree, int bits, int value) {
  int node = 1;
  for (int i = bits - 1; i >= 0; --i) node = node << 1 | coder->bit(tree + node, value >> i & 1);
  return node - (1 << bits);
}

struct Pixel {
  uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Pixel&) const = default;
  uint8_t highest() const { return std::max({r, g, b}); }
};
/// A coded pixel and the way in which it was coded.
struct Coded {
  Pixel pixel;
  uint8_t how = 0;  // index of the equal candidate, or kNew if none is equal
  uint8_t hue = 0;  // index of the hue; black pixels have none
};

// Candidates: the pixels to the left, above, in the previous frame, and above to the right.
constexpr int kCandidates = 4, kNew = kCandidates;
constexpr int kHueBits = 5, kNoHue = 30, kFree = 31;
constexpr int kNumHows = kCandidates + 1, kNumHues = 1 << kHueBits;

/// Returns the pixel of a hue with this brightness, which is the value of the highest channel.
Pixel shade(const ReplayHue& hue, int brightness) {
  const int highest = std::max({hue[0], hue[1], hue[2]});
  const auto channel = [&](int value) {
    return static_cast<uint8_t>((2 * value * brightness + highest) / (2 * highest));
  };
  return {channel(hue[0]), channel(hue[1]), channel(hue[2])};
}

/// Codes pixel after pixel. With an Encoder, code() writes the given pixel. With a Decoder, it returns the decoded
/// pixel.
template <typename Coder>
class PixelCoder {
 public:
  explicit PixelCoder(Coder coder) : coder_(std::move(coder)), hues_(replay_hues()) {}
  Coder& coder() { return coder_; }

  Coded code(const Coded& left, const Coded& above, const Coded& before, const Coded& right_above, const Coded& corner,
             Pixel pixel) {
    const Coded* candidates[kCandidates] = {&left, &above, &before, &right_above};
    const Pixel w = left.pixel, n = above.pixel, p = before.pixel, ne = right_above.pixel, nw = corner.pixel;
    const int alike = (w == n) | (w == p) << 1 | (n == p) << 2 | (n == ne) << 3 | (nw == w) << 4 | (nw == n) << 5;
    const int context = ((alike * kNumHows + left.how) * kNumHows + above.how) * kNumHows + before.how;
    for (int i = 0; i < kCandidates; ++i) {
      bool repeats = false;
      for (int j = 0; j < i; ++j) repeats = repeats || candidates[j]->pixel == candidates[i]->pixel;
      if (repeats) continue;
      if (coder_.bit(&is_candidate_[i][context], pixel == candidates[i]->pixel)) {
        return {candidates[i]->pixel, static_cast<uint8_t>(i), candidates[i]->hue};
      }
    }
    const int hue = code_number(&coder_, hue_[left.hue][above.hue], kHueBits, hue_of(pixel));
    if (hue >= static_cast<int>(hues_.size())) return {code_free(pixel), kNew, kFree};
    const int brightness = code_number(&coder_, brightness_[hue][p.highest() >> 5], 8, pixel.highest());
    const Pixel guess = shade(hues_[hue], brightness);
    const auto near = [&](int channel, uint8_t guessed, uint8_t value) {
      BitModel* chances = rounding_[hue][channel];
      if (coder_.bit(chances, value != guessed) == 0) return guessed;
      return static_cast<uint8_t>(coder_.bit(chances + 1, value > guessed) ? guessed + 1 : guessed - 1);
    };
    return {{near(0, guess.r, pixel.r), near(1, guess.g, pixel.g), near(2, guess.b, pixel.b)},
            kNew,
            static_cast<uint8_t>(hue)};
  }

 private:
  /// Returns the nearest hue that matches the pixel up to rounding, else kFree.
  int hue_of(Pixel pixel) const {
    int best = kFree, minimum = 4;
    for (size_t i = 0; i < hues_.size(); ++i) {
      const Pixel guess = shade(hues_[i], pixel.highest());
      const int r = std::abs(guess.r - pixel.r), g = std::abs(guess.g - pixel.g), b = std::abs(guess.b - pixel.b);
      if (std::max({r, g, b}) > 1 || r + g + b >= minimum) continue;
      best = static_cast<int>(i);
      minimum = r + g + b;
    }
    return best;
  }
  /// Codes a pixel without a hue, such as a blend of hues. The probabilities of each channel depend on the high bits of
  /// the previous channel.
  Pixel code_free(Pixel pixel) {
    const int r = code_number(&coder_, free_[0][0], 8, pixel.r);
    const int g = code_number(&coder_, free_[1][r >> 4], 8, pixel.g);
    const int b = code_number(&coder_, free_[2][g >> 4], 8, pixel.b);
    return {static_cast<uint8_t>(r), static_cast<uint8_t>(g), static_cast<uint8_t>(b)};
  }

  Coder coder_;
  std::vector<ReplayHue> hues_;
  BitModel is_candidate_[kCandidates][64 * kNumHows * kNumHows * kNumHows];
  BitModel hue_[kNumHues][kNumHues][kNumHues];
  BitModel brightness_[kNumHues][8][256];
  BitModel rounding_[kNumHues][3][2];
  BitModel free_[3][16][256];
};

/// Codes all frames. next(offset) returns the pixel to encode at a byte offset, and put(offset, pixel) receives the
/// coded pixel.
template <typename Coder, typename Next, typename Put>
void code_frames(const std::vector<ReplayCamera>& cameras, size_t num_frames, PixelCoder<Coder>* coder, Next&& next,
                 Put&& put) {
  const Coded black{.pixel = {}, .how = 0, .hue = kNoHue};
  // The previous frame, which the current frame overwrites pixel by pixel.
  std::vector<std::vector<Coded>> images;
  for (const ReplayCamera& camera : cameras) {
    images.emplace_back(static_cast<size_t>(camera.width_px) * static_cast<size_t>(camera.height_px), black);
  }
  size_t offset = 0;
  for (size_t frame = 0; frame < num_frames; ++frame) {
    for (size_t c = 0; c < cameras.size(); ++c) {
      const auto width = static_cast<size_t>(cameras[c].width_px), height = static_cast<size_t>(cameras[c].height_px);
      for (size_t y = 0; y < height; ++y) {
        Coded* row = images[c].data() + y * width;
        const Coded* above = row - width;
        for (size_t x = 0; x < width; ++x, offset += 3) {
          const Coded& corner = x > 0 && y > 0 ? above[x - 1] : black;
          row[x] = coder->code(x > 0 ? row[x - 1] : black, y > 0 ? above[x] : black, row[x],
                               y > 0 && x + 1 < width ? above[x + 1] : black, corner, next(offset));
          put(offset, row[x].pixel);
        }
      }
    }
  }
}

}  // namespace

namespace {

// Checksum of all frames of a group. It is needed because the decoder cannot detect damaged bytes.
constexpr size_t kChecksumBytes = 4;
uint32_t checksum(std::string_view frames) {
  const uLong begin = adler32(0, nullptr, 0);
  return static_cast<uint32_t>(adler32_z(begin, reinterpret_cast<const Bytef*>(frames.data()), frames.size()));
}

}  // namespace

ReplayHue replay_hue(Rgb color) {
  const auto byte = [](float channel) { return static_cast<uint8_t>(channel * 255 + 0.5f); };
  return {byte(color.r), byte(color.g), byte(color.b)};
}

std::vector<ReplayHue> replay_hues() {
  std::vector<ReplayHue> hues;
  const auto add = [&hues](Rgb color) { hues.push_back(replay_hue(color)); };
  for (const Rgb color :
       {kWhiteMarkColor, kYellowMarkColor, kRoadEdgeColor, kCrosswalkColor, kStopLineColor, kWallColor}) {
    add(color);
  }
  for (int agent_class = 0; agent_class < kNumAgentClasses; ++agent_class) {
    for (int face = 0; face < kNumBoxFaces; ++face) {
      add(agent_color(static_cast<AgentClass>(agent_class), static_cast<BoxFace>(face)));
    }
  }
  for (const LightState state : {LightState::red, LightState::yellow, LightState::green}) add(light_color(state));
  return hues;
}

size_t bytes_of_frame(const std::vector<ReplayCamera>& cameras) {
  size_t bytes = 0;
  for (const ReplayCamera& camera : cameras) {
    bytes += static_cast<size_t>(camera.width_px) * static_cast<size_t>(camera.height_px) * 3;
  }
  return bytes;
}

std::string pack_images(const std::vector<ReplayCamera>& cameras, std::string_view frames) {
  auto coder = std::make_unique<PixelCoder<Encoder>>(Encoder());
  const auto* bytes = reinterpret_cast<const uint8_t*>(frames.data());
  code_frames(
      cameras, frames.size() / bytes_of_frame(cameras), coder.get(),
      [bytes](size_t at) { return Pixel{bytes[at], bytes[at + 1], bytes[at + 2]}; }, [](size_t, Pixel) {});
  std::string group = coder->coder().finish();
  const uint32_t sum = checksum(frames);
  for (int shift = 24; shift >= 0; shift -= 8) group.push_back(static_cast<char>(sum >> shift & 0xFF));
  return group;
}

std::string unpack_images(const std::vector<ReplayCamera>& cameras, std::string_view group, int count) {
  std::string frames(bytes_of_frame(cameras) * static_cast<size_t>(count), '\0');
  PICTURA_CHECK(group.size() >= kChecksumBytes, "images: a group is truncated after {} bytes", group.size());
  const std::string_view coded = group.substr(0, group.size() - kChecksumBytes);
  auto coder = std::make_unique<PixelCoder<Decoder>>(Decoder(coded));
  code_frames(
      cameras, static_cast<size_t>(count), coder.get(), [](size_t) { return Pixel{}; },
      [&frames](size_t at, Pixel pixel) { std::memcpy(frames.data() + at, &pixel, 3); });
  uint32_t sum = 0;
  for (const char byte : group.substr(coded.size())) sum = sum << 8 | static_cast<uint8_t>(byte);
  PICTURA_CHECK(sum == checksum(frames), "images: a group is damaged: wrong checksum");
  return frames;
}

}  // namespace pictura
