// Writers of pixels: one for all formats and orders, and one that writes nothing.
#pragma once

#include "pictura/backend_cuda/renderer/fragments.cuh"
#include "pictura/backend_cuda/renderer/rig.cuh"
#include "pictura/common/patches.h"
#include "pictura/common/portable/intrinsics.h"

namespace pictura::cuda {

struct ImageWriter {
  PixelFormat format;
  ChannelOrder order;
  void* images;
  int64_t first, plane;  // in elements: offset of the image, stride of planes
  int width_px, height_px;
  int patch_px;  // if the order is patches

  /// Stores the colour of a pixel with fragments, in the first fragment of its list.
  template <typename Memory>
  __device__ void store_color(const Memory& memory, int fragment, Rgb color) const {
    if (has_bytes()) {
      memory.set_color_bytes(fragment, to_bytes(color));
    } else {
      memory.set_color(fragment, color);
    }
  }

  /// Writes at most kPixelsPerWrite neighbouring pixels, given their words.
  template <typename Memory>
  __device__ void pixels(const Memory& memory, int x, int y, int count, const typename Memory::Word* words) const {
    const Place place{x, y, count};
    if (format == PixelFormat::u8) {
      write_bytes(memory, static_cast<uint8_t*>(images), place, words, [](uint8_t v) { return v; });
    } else if (format == PixelFormat::bf16) {
      write_bytes(memory, static_cast<uint16_t*>(images), place, words, [](uint8_t v) { return bf16_of_byte(v); });
    } else if (format == PixelFormat::f16) {
      write_floats(memory, static_cast<uint16_t*>(images), place, words, [](float v) { return to_half(v); });
    } else {
      write_floats(memory, static_cast<float*>(images), place, words, [](float v) { return saturate(v); });
    }
  }

 private:
  template <typename Value>
  struct alignas(kPixelsPerWrite * sizeof(Value)) PixelVector {
    Value value[kPixelsPerWrite];
  };
  // `count` neighbouring pixels from (x, y) on.
  struct Place {
    int x, y, count;
  };
  // Division by a constant is several times as fast as by patch_px.
  __device__ int64_t place_in_patch(const Place& place) const {
    switch (patch_px) {
      case 8: return place_in_patches(8, width_px, 0, place.x, place.y);
      case 12: return place_in_patches(12, width_px, 0, place.x, place.y);
      case 16: return place_in_patches(16, width_px, 0, place.x, place.y);
      default: return place_in_patches(4, width_px, 0, place.x, place.y);
    }
  }

  // Calls change(effect, i) for each pixel if the image has an effect.
  template <typename Change>
  __device__ void for_each_pixel_with_effect(const Place& place, Change&& change) const {
    if constexpr (kRandomizesCameras) {
      const ImageEffect& effect = block_state()->effect;
      if (!effect.is_on) return;
      for (int i = 0; i < kPixelsPerWrite; ++i) {
        if (i < place.count) change(effect, i);
      }
    }
  }

  __device__ bool has_bytes() const { return format == PixelFormat::u8 || format == PixelFormat::bf16; }

  template <typename Memory, typename Value, typename ValueOf>
  __device__ void write_bytes(const Memory& memory, Value* all, const Place& place, const typename Memory::Word* words,
                              ValueOf&& value_of) const {
    // Skips lookups for black words, because many warps write only black.
    uint32_t bytes[kPixelsPerWrite] = {};
    typename Memory::Word some = 0;
    for (int i = 0; i < kPixelsPerWrite; ++i) some |= words[i];
    for (int i = 0; i < kPixelsPerWrite && some != 0; ++i) {
      const auto full = full_of_word<Memory>(words[i]), head = first_of_word<Memory>(words[i]);
      bytes[i] = head != Memory::kNone   ? memory.color_bytes(static_cast<int>(head))
                 : full != Memory::kNone ? memory.faces[full].color_bytes
                                         : 0u;
    }
    for_each_pixel_with_effect(
        place, [&](const ImageEffect& effect, int i) { bytes[i] = effect.of_bytes(bytes[i], place.x + i, place.y); });
    store_channels(all + first, place,
                   [&](int i, int channel) { return value_of(static_cast<uint8_t>(bytes[i] >> (8 * channel))); });
  }

  template <typename Memory, typename Value, typename ValueOf>
  __device__ void write_floats(const Memory& memory, Value* all, const Place& place, const typename Memory::Word* words,
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
    for_each_pixel_with_effect(
        place, [&](const ImageEffect& effect, int i) { colors[i] = effect.of(colors[i], place.x + i, place.y); });
    store_channels(all + first, place, [&](int i, int channel) {
      return value_of(channel == 0 ? colors[i].r : channel == 1 ? colors[i].g : colors[i].b);
    });
  }

  // value_of(i, channel): channel of the i-th pixel.
  template <typename Value, typename ValueOf>
  __device__ void store_channels(Value* image, const Place& place, ValueOf&& value_of) const {
    auto store_each = [&](Value* to, int64_t step, int count) {
      PICTURA_NO_UNROLL
      for (int channel = 0; channel < 3; ++channel, to += step) {
        PixelVector<Value> values;
        for (int i = 0; i < kPixelsPerWrite; ++i) values.value[i] = value_of(i, channel);
        store(to, count, values);
      }
    };
    // Planes need no test for the end of a patch.
    if (order != ChannelOrder::patches) {
      store_each(image + static_cast<int64_t>(place.y) * width_px + place.x, plane, place.count);
      return;
    }
    // The pixels of one write lie in one patch (see plan_next_part), and words beyond a part are black.
    static_assert(kDefaultPatch_px % kPixelsPerWrite == 0);
    const bool is_right = place.x + place.count == width_px;
    store_each(image + place_in_patch(place), patch_px * patch_px,
               is_right ? kPixelsPerWrite - place.x % kPixelsPerWrite : place.count);
    if (is_right || place.y + 1 == height_px) blacken_beyond(image, place, width_px, height_px, patch_px);
  }

  // Blackens the part of these pixels' patch that is beyond the image. It is not inlined, to save registers.
  template <typename Value>
  __device__ __noinline__ static void blacken_beyond(Value* image, Place place, int width_px, int height_px,
                                                     int patch_px) {
    const int columns = place.x + place.count == width_px ? patch_px - place.x % patch_px : place.count;
    const int rows = place.y + 1 == height_px ? patch_px - place.y % patch_px : 1;
    Value* to = image + place_in_patches(patch_px, width_px, 0, place.x, place.y);
    PICTURA_NO_UNROLL
    for (int channel = 0; channel < 3; ++channel, to += patch_px * patch_px) {
      PICTURA_NO_UNROLL
      for (int row = 0; row < rows; ++row) {
        // In the first row, the pixels up to the next multiple of kPixelsPerWrite are already written.
        PICTURA_NO_UNROLL
        for (int x = row == 0 ? kPixelsPerWrite - place.x % kPixelsPerWrite : 0; x < columns; x += kPixelsPerWrite) {
          store(to + row * patch_px + x, min_of(columns - x, kPixelsPerWrite), PixelVector<Value>{});
        }
      }
    }
  }

  // Uses one vector store if all pixels are written and the address is aligned.
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

struct NoImage {
  template <typename Memory>
  __device__ void store_color(const Memory&, int, Rgb) const {}
  template <typename Memory>
  __device__ void pixels(const Memory&, int, int, int, const typename Memory::Word*) const {}
};

}  // namespace pictura::cuda
