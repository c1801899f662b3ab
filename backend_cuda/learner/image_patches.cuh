// Kernel that cuts images into patches.
#pragma once

#include "pictura/backend_cuda/learner/activation.cuh"
#include "pictura/policy/rules/network_passes.h"

namespace pictura::cuda::image_patches {

/// Largest number of patches of a block: neighbours in a row of patches.
constexpr int kTile = 32;

/// Pixels of a tile, [color and row, column]; black beyond the image. The stride of rows avoids conflicts of banks.
template <int kPatch>
struct Tile {
  static constexpr int kRows = 3 * kPatch, kStride = kTile * kPatch + 4;
  alignas(16) uint8_t pixels[kRows][kStride];
};

extern __shared__ __align__(16) unsigned char tile_memory[];

// Word: type of the loads. Rows of the image must be whole words at multiples of their size.
template <typename Word, int kPatch>
__device__ void load_tile(const uint8_t* image, int height, int width, int first_y, int first_x, int columns,
                          Tile<kPatch>* out) {
  constexpr int kPixels = sizeof(Word);
  const int words = columns / kPixels;
  for (int i = static_cast<int>(threadIdx.x); i < Tile<kPatch>::kRows * words; i += kThreads) {
    const int row = i / words, x = i % words * kPixels, y = first_y + row % kPatch;
    const uint8_t* const from = image + (row / kPatch * height + y) * width + first_x + x;
    const bool is_inside = y < height && first_x + x < width;
    *reinterpret_cast<Word*>(&out->pixels[row][x]) = is_inside ? *reinterpret_cast<const Word*>(from) : Word{0};
  }
}

// A block writes a tile of the patches of an image, a thread vectors of 16 bytes. Indices fit into 32 bits, except for
// offsets of images.
template <typename T, int kPatch>
__global__ void __launch_bounds__(kThreads) patches(PatchSize size, const uint8_t* images, T* out) {
  constexpr int kWidth = 16 / sizeof(T), kChannels = static_cast<int>(PatchSize::channels_of(kPatch));
  constexpr int kVectors = kChannels / kWidth;
  Tile<kPatch>& tile = *reinterpret_cast<Tile<kPatch>*>(tile_memory);
  const auto columns = static_cast<int>(size.columns()), height = static_cast<int>(size.height_px),
             width = static_cast<int>(size.width_px), views = static_cast<int>(size.views);
  const int image_index = static_cast<int>(blockIdx.x), row = static_cast<int>(blockIdx.y),
            first_column = static_cast<int>(blockIdx.z) * kTile;
  const int num_patches = columns - first_column < kTile ? columns - first_column : kTile;
  const int camera = image_index / views, view = image_index % views;
  const uint8_t* const image = images + (view * size.cameras + camera) * 3 * static_cast<int64_t>(height) * width;
  const int first_y = row * kPatch, first_x = first_column * kPatch, columns_of_tile = num_patches * kPatch;
  if (width % 4 == 0 && columns_of_tile % 4 == 0)
    load_tile<uint32_t>(image, height, width, first_y, first_x, columns_of_tile, &tile);
  else
    load_tile<uint8_t>(image, height, width, first_y, first_x, columns_of_tile, &tile);
  __syncthreads();

  T* const its_out = out + ((image_index * int64_t{gridDim.y} + row) * columns + first_column) * int64_t{kChannels};
  for (int i = static_cast<int>(threadIdx.x); i < num_patches * kVectors; i += kThreads) {
    const int x = i / kVectors * kPatch, channel = i % kVectors * kWidth;
    struct alignas(16) Vector {
      T values[kWidth];
    } vector;
#pragma unroll
    for (int k = 0; k < kWidth; ++k) {
      const int c = channel + k;
      const bool is_pixel = c < Tile<kPatch>::kRows * kPatch;
      vector.values[k] = from_float<T>(is_pixel ? tile.pixels[c / kPatch][x + c % kPatch] : 0);
    }
    reinterpret_cast<Vector*>(its_out)[i] = vector;
  }
}

}  // namespace pictura::cuda::image_patches
