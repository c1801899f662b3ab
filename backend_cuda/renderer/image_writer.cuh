// Writes pixels as bytes, halves or floats, one plane per channel, several neighbours per store; or not at all.
#pragma once

#include "pictura/backend_cuda/renderer/fragments.cuh"
#include "pictura/common/portable/intrinsics.h"

namespace pictura::cuda {

/// Writes the pixels of one image, one plane per channel.
struct ImageWriter {
  PixelFormat format;
  void* images;
  int64_t first, plane;  // in elements: the image's offset, and the stride of planes
  int width_px;

  /// Stores the colour of a pixel with a fragment list at the first of its fragments.
  template <typename Memory>
  __device__ void store_color(const Memory& memory, int fragment, Rgb color) const {
    if (format == PixelFormat::u8) {
      memory.set_color_bytes(fragment, to_bytes(color));
    } else {
      memory.set_color(fragment, color);
    }
  }

  /// Writes at most kPixelsPerWrite neighbouring pixels, given their words.
  template <typename Memory>
  __device__ void pixels(const Memory& memory, int x, int y, int count, const typename Memory::Word* words) const {
    const int64_t at = first + static_cast<int64_t>(y) * width_px + x;
    if (format == PixelFormat::u8) {
      write_bytes(memory, static_cast<uint8_t*>(images) + at, count, words);
    } else if (format == PixelFormat::f16) {
      write_floats(memory, static_cast<uint16_t*>(images) + at, count, words, [](float v) { return to_half(v); });
    } else {
      write_floats(memory, static_cast<float*>(images) + at, count, words, [](float v) { return saturate(v); });
    }
  }

 private:
  template <typename Value>
  struct alignas(kPixelsPerWrite * sizeof(Value)) PixelVector {
    Value value[kPixelsPerWrite];
  };

  template <typename Memory>
  __device__ void write_bytes(const Memory& memory, uint8_t* to, int count, const typename Memory::Word* words) const {
    // Many warps write only black.
    uint32_t bytes[kPixelsPerWrite] = {};
    typename Memory::Word some = 0;
    for (int i = 0; i < kPixelsPerWrite; ++i) some |= words[i];
    for (int i = 0; i < kPixelsPerWrite && some != 0; ++i) {
      const auto full = full_of_word<Memory>(words[i]), head = first_of_word<Memory>(words[i]);
      bytes[i] = head != Memory::kNone   ? memory.color_bytes(static_cast<int>(head))
                 : full != Memory::kNone ? memory.faces[full].color_bytes
                                         : 0u;
    }
    store_channels(to, count, [&](int i, int channel) { return static_cast<uint8_t>(bytes[i] >> (8 * channel)); });
  }

  template <typename Memory, typename Value, typename ValueOf>
  __device__ void write_floats(const Memory& memory, Value* to, int count, const typename Memory::Word* words,
                               ValueOf&& value_of) const {
    Rgb colors[kPixelsPerWrite];
    for (int i = 0; i < kPixelsPerWrite; ++i) {
      const auto full = full_of_word<Memory>(words[i]), head = first_of_word<Memory>(words[i]);
      if (head != Memory::kNone) {
        colors[i] = memory.color(static_cast<int>(head));
      } else if (full != Memory::kNone) {
        colors[i] = memory.faces[full].color;
      }
    }
    store_channels(to, count, [&](int i, int channel) {
      return value_of(channel == 0 ? colors[i].r : channel == 1 ? colors[i].g : colors[i].b);
    });
  }

  // value_of(i, channel) is a channel of the i-th pixel.
  template <typename Value, typename ValueOf>
  __device__ void store_channels(Value* to, int count, ValueOf&& value_of) const {
    PICTURA_NO_UNROLL
    for (int channel = 0; channel < 3; ++channel, to += plane) {
      PixelVector<Value> values;
      for (int i = 0; i < kPixelsPerWrite; ++i) values.value[i] = value_of(i, channel);
      store(to, count, values);
    }
  }

  // One vector store if all pixels are written and the address is aligned.
  template <typename Value>
  __device__ static void store(Value* to, int count, const PixelVector<Value>& values) {
    if (count == kPixelsPerWrite && reinterpret_cast<uintptr_t>(to) % sizeof(values) == 0) {
      *reinterpret_cast<PixelVector<Value>*>(to) = values;
      return;
    }
    for (int i = 0; i < kPixelsPerWrite; ++i) {
      if (i < count) to[i] = values.value[i];
    }
  }
};

/// Writes nothing.
struct NoImage {
  template <typename Memory>
  __device__ void store_color(const Memory&, int, Rgb) const {}
  template <typename Memory>
  __device__ void pixels(const Memory&, int, int, int, const typename Memory::Word*) const {}
};

}  // namespace pictura::cuda
