// The memory of a block: what stands where in shared memory, or in the global memory of blocks that draw what does not
// fit into that. Any function of a kernel can ask for it.
#pragma once

#include "pictura/backend_cuda/renderer_cuda_block.cuh"

namespace pictura::cuda {

// Most images fit into a block of this much.
constexpr int kSmallBlocksPerProcessor = 5;
constexpr int kSmallVisible = 3072, kSmallQuads = 384, kSmallLights = 256, kSmallFaces = 1280, kSmallEdges = 5632,
              kSmallPixels = 96 * 12, kSmallFragments = 640;
static_assert(most_sums(kSmallFragments) * sizeof(SharedSum) <= sizeof(BlockState::warps));
static_assert(kSmallFaces <= kMostMarkedFaces && kSmallFragments < 0xFFFF && kSmallPixels < 0xFFFF);
// Pixels of a band of the second launch: a row of the widest image at least.
constexpr int kLargePixels = 1 << 14;

/// A block's arrays. Index: of faces and fragments, 16 bits where they suffice. Word: two of them.
template <typename Index_, typename Word_>
struct BlockMemory {
  using Index = Index_;
  using Word = Word_;
  static constexpr int kHalf = 4 * sizeof(Word);
  /// Of the lower half of a word: no face, the end of a list.
  static constexpr Word kNone = (Word{1} << kHalf) - 1;

  BlockState* state;
  ScreenFace* faces;
  PolygonEdge* edges;
  Quad* quads;  // [max_quads] that are to be clipped
  // While faces are made.
  uint32_t* visible;  // [max_visible] what may show
  uint32_t* lights;   // [max_lights] ... that are lights
  // While pixels are drawn.
  Word* pixels;           // [max_pixels] of a band
  uint32_t* full_listed;  // [max_pixels / 32 + 1] a bit for each pixel: its full face stands among its fragments
  // Fragments, each of one pixel and linked to the pixel's others.
  uint32_t *samples_low, *samples_high, *free_low, *free_high;  // [max_fragments]
  float* area;                                                  // [max_fragments]
  Index *next, *face, *pixel;                                   // [max_fragments]
  SharedSum* sums;                                              // [most_sums(max_fragments)] of pixels with many
  int32_t max_visible, max_quads, max_lights, max_faces, max_edges, max_pixels, max_fragments;

  __device__ PixelCoverage coverage(int fragment) const {
    return {area[fragment], static_cast<uint64_t>(samples_high[fragment]) << 32 | samples_low[fragment]};
  }
  __device__ uint64_t free(int fragment) const {
    return static_cast<uint64_t>(free_high[fragment]) << 32 | free_low[fragment];
  }
};

// Puts arrays side by side.
struct Layout {
  unsigned char* bytes;
  size_t used = 0;
  template <typename Value>
  __host__ __device__ void place(Value** array, int count) {
    *array = reinterpret_cast<Value*>(bytes + used);
    used += (static_cast<size_t>(count) * sizeof(Value) + 7) / 8 * 8;
  }
};

// Lays out a block's memory besides its faces and edges from `bytes` on, and returns how many bytes that takes. What is
// used while faces are made lies where pixels and fragments do later.
template <typename Memory>
__host__ __device__ size_t lay_out(Memory* memory, const Scratch& sizes, int max_pixels, unsigned char* bytes) {
  memory->max_visible = sizes.max_visible;
  memory->max_quads = sizes.max_quads;
  memory->max_lights = sizes.max_lights;
  memory->max_faces = sizes.max_faces;
  memory->max_edges = sizes.max_edges;
  memory->max_fragments = sizes.max_fragments;
  memory->max_pixels = max_pixels;
  Layout of_faces{bytes}, of_pixels{bytes};
  of_faces.place(&memory->visible, memory->max_visible);
  of_faces.place(&memory->lights, memory->max_lights);
  of_pixels.place(&memory->pixels, max_pixels);
  of_pixels.place(&memory->full_listed, max_pixels / 32 + 1);
  of_pixels.place(&memory->samples_low, memory->max_fragments);
  of_pixels.place(&memory->samples_high, memory->max_fragments);
  of_pixels.place(&memory->free_low, memory->max_fragments);
  of_pixels.place(&memory->free_high, memory->max_fragments);
  of_pixels.place(&memory->area, memory->max_fragments);
  of_pixels.place(&memory->next, memory->max_fragments);
  of_pixels.place(&memory->face, memory->max_fragments);
  of_pixels.place(&memory->pixel, memory->max_fragments);
  if (Memory::kHasOwnSums) of_pixels.place(&memory->sums, most_sums(memory->max_fragments));
  return of_faces.used > of_pixels.used ? of_faces.used : of_pixels.used;
}

constexpr size_t kStateBytes = (sizeof(BlockState) + 15) / 16 * 16;

__host__ __device__ inline Scratch small_sizes() {
  Scratch scratch;
  scratch.max_visible = kSmallVisible;
  scratch.max_quads = kSmallQuads;
  scratch.max_lights = kSmallLights;
  scratch.max_faces = kSmallFaces;
  scratch.max_edges = kSmallEdges;
  scratch.max_fragments = kSmallFragments;
  return scratch;
}

extern __shared__ __align__(16) unsigned char block_memory[];
__device__ inline BlockState* block_state() { return reinterpret_cast<BlockState*>(block_memory); }

template <typename Memory>
__device__ inline Memory with_global_arrays(Memory memory) {
  memory.state = block_state();
  memory.faces = memory.state->scratch.faces;
  memory.edges = memory.state->scratch.edges;
  memory.quads = memory.state->scratch.quads;
  return memory;
}

/// All in shared memory, at places that are known when the kernel is compiled.
struct SmallMemory : BlockMemory<uint16_t, uint32_t> {
  // Sums lie where warps keep their edges and queues until then.
  static constexpr bool kHasOwnSums = false;
  __device__ static SmallMemory current() {
    SmallMemory memory;
    lay_out(&memory, small_sizes(), kSmallPixels, block_memory + kStateBytes);
    memory.sums = reinterpret_cast<SharedSum*>(block_state()->warps);
    return with_global_arrays(memory);
  }
};

/// In global memory.
struct LargeMemory : BlockMemory<uint32_t, unsigned long long> {
  static constexpr bool kHasOwnSums = true;
  __device__ static LargeMemory current() {
    LargeMemory memory;
    lay_out(&memory, block_state()->scratch, kLargePixels, block_state()->scratch.bytes);
    return with_global_arrays(memory);
  }
};

__host__ __device__ inline size_t small_bytes() {
  SmallMemory memory;
  return kStateBytes + lay_out(&memory, small_sizes(), kSmallPixels, nullptr);
}
__host__ __device__ inline size_t large_bytes(const Scratch& sizes) {
  LargeMemory memory;
  return lay_out(&memory, sizes, kLargePixels, nullptr);
}

// Gives the block its part of a launch's scratch memory. All threads of the block.
__device__ inline void take_scratch(const Scratch& scratch) {
  if (threadIdx.x == 0) {
    Scratch own = scratch;
    own.faces += static_cast<size_t>(blockIdx.x) * static_cast<size_t>(scratch.max_faces);
    own.edges += static_cast<size_t>(blockIdx.x) * static_cast<size_t>(scratch.max_edges);
    own.quads += static_cast<size_t>(blockIdx.x) * static_cast<size_t>(scratch.max_quads);
    if (own.bytes) own.bytes += blockIdx.x * large_bytes(scratch);
    block_state()->scratch = own;
  }
  __syncthreads();
}

}  // namespace pictura::cuda
