// Memory layout of a block: in shared memory, or in global memory if its data does not fit there.
#pragma once

#include "pictura/backend_cuda/renderer/block.cuh"
#include "pictura/common/raster/compositing.h"

namespace pictura::cuda {

constexpr int kSetupThreads = 32, kCullBlocksPerProcessor = 32, kFaceSetupBlocksPerProcessor = 32,
              kClipBlocksPerProcessor = 24;
// A tile with more than kDrawFragments fragments is drawn in parts.
constexpr int kDrawThreads = 256, kDrawBlocksPerProcessor = 4;
constexpr int kDrawPixels = kTileWidth_px * kTileHeight_px, kDrawFragments = 1152;
constexpr int kDeferredBlocksPerProcessor = 2;
// Blocks of the overflow launch and of the visibility launch.
constexpr int kLargeThreads = 128, kLargePixels = kTileWidth_px * 512, kLargeFragments = 1 << 16;

// Bits of a 32-bit pixel word that hold a face, and the number of faces that they can distinguish.
constexpr int kMarkedFaceBits = 11, kMaxMarkedFaces = (1 << kMarkedFaceBits) - 1;

/// Arrays for drawing. Index: type of an index of a face, pixel or fragment. Word: type of a pair of indices.
template <typename Index_, typename Word_, int kThreads_>
struct DrawMemory {
  using Index = Index_;
  using Word = Word_;
  static constexpr int kThreads = kThreads_;
  static constexpr int kHalf = 4 * sizeof(Word);
  /// Marks a word's lower half without face or pixel.
  static constexpr Word kNone = (Word{1} << kHalf) - 1;
  /// Flag in a candidate's lower half: the face covers the pixel fully.
  static constexpr Word kCoversFully = Word{1} << (kHalf - 1);
  /// coded_pixel: lower half of a candidate.
  __device__ static int pixel_of(uint32_t coded_pixel) {
    return static_cast<int>(coded_pixel & ~static_cast<uint32_t>(kCoversFully));
  }
  __device__ static bool covers_fully(uint32_t coded_pixel) { return (coded_pixel & kCoversFully) != 0; }

  BlockState* state;
  const ScreenFace* faces;
  const PolygonEdge* edges;  // indexed by the faces' edge_begin
  Word* pixels;              // [max_pixels] of the current part, see PixelWord
  Word* rows;                // [max_rows] rows of faces: face in the upper half, row of the part in the lower half
  Word* candidates;          // [max_candidates] possible fragments: face in the upper half, pixel in the lower half
  // Arrays for planes, which share memory with arrays of fragments and candidates:
  Index* layer_face;  // [max_layers] face that covers the centre of a pixel
  Index* layer_next;  // [max_layers] next layer in the pixel's list, plus 1; 0 ends a list
  // Arrays of fragments:
  uint32_t *samples_low, *samples_high, *visible_low, *visible_high;  // [max_fragments]
  float* area;                                                        // [max_fragments]
  Index *face, *pixel, *next;  // [max_fragments] next: next fragment in the pixel's list, or kNone
  Index* kind;                 // [max_fragments] kind of the weight; shares memory with `pixel`
  Index* composited;           // [max_fragments] pixels to be composited
  int32_t max_pixels, max_rows, max_candidates, max_fragments, max_layers;

  __device__ uint64_t samples(int fragment) const {
    return static_cast<uint64_t>(samples_high[fragment]) << 32 | samples_low[fragment];
  }
  __device__ PixelCoverage coverage(int fragment) const { return {area[fragment], samples(fragment)}; }
  __device__ uint64_t visible(int fragment) const {
    return static_cast<uint64_t>(visible_high[fragment]) << 32 | visible_low[fragment];
  }
  // After compute_weights, a fragment's four sample words hold its contribution to the pixel. After compositing, the
  // words of a list's first fragment hold the pixel's colour, as floats or bytes.
  __device__ void set_part(int fragment, const PixelAccumulator::Part& part) const {
    samples_low[fragment] = static_cast<uint32_t>(part.area);
    samples_high[fragment] = static_cast<uint32_t>(part.r);
    visible_low[fragment] = static_cast<uint32_t>(part.g);
    visible_high[fragment] = static_cast<uint32_t>(part.b);
  }
  __device__ PixelAccumulator::Part part(int fragment) const {
    return {static_cast<int32_t>(samples_low[fragment]), static_cast<int32_t>(samples_high[fragment]),
            static_cast<int32_t>(visible_low[fragment]), static_cast<int32_t>(visible_high[fragment])};
  }
  __device__ void set_color(int fragment, Rgb color) const {
    samples_low[fragment] = __float_as_uint(color.r);
    samples_high[fragment] = __float_as_uint(color.g);
    visible_low[fragment] = __float_as_uint(color.b);
  }
  __device__ void set_color_bytes(int fragment, uint32_t bytes) const { samples_low[fragment] = bytes; }
  __device__ uint32_t color_bytes(int fragment) const { return samples_low[fragment]; }
  __device__ Rgb color(int fragment) const {
    return {__uint_as_float(samples_low[fragment]), __uint_as_float(samples_high[fragment]),
            __uint_as_float(visible_low[fragment])};
  }
};

// Places arrays in sequence, aligned to 16 bytes.
struct Layout {
  unsigned char* bytes;
  size_t used = 0;
  template <typename Value>
  __host__ __device__ void place(Value** array, int count) {
    *array = reinterpret_cast<Value*>(bytes + used);
    used += (static_cast<size_t>(count) * sizeof(Value) + 15) / 16 * 16;
  }
};

// Places the arrays from `bytes` on, and returns their size in bytes. Rows share memory with samples. Candidates and
// `layer_next` share memory with visible samples and `composited`; `layer_face` shares memory with the arrays from
// `area` to `next`.
template <typename Memory>
__host__ __device__ size_t lay_out(Memory* memory, int max_pixels, int max_fragments, unsigned char* bytes) {
  memory->max_pixels = max_pixels;
  memory->max_fragments = max_fragments;
  Layout layout{bytes};
  layout.place(&memory->pixels, max_pixels);
  const size_t fragments_begin = layout.used;
  layout.place(&memory->area, max_fragments);
  layout.place(&memory->face, max_fragments);
  layout.place(&memory->pixel, max_fragments);
  layout.place(&memory->next, max_fragments);
  const size_t rows_begin = layout.used;
  layout.place(&memory->samples_low, max_fragments);
  layout.place(&memory->samples_high, max_fragments);
  const size_t candidates_begin = layout.used;
  layout.place(&memory->visible_low, max_fragments);
  layout.place(&memory->visible_high, max_fragments);
  layout.place(&memory->composited, max_fragments);
  memory->kind = memory->pixel;
  using Word = typename Memory::Word;
  using Index = typename Memory::Index;
  memory->rows = reinterpret_cast<Word*>(bytes + rows_begin);
  memory->max_rows = static_cast<int32_t>((candidates_begin - rows_begin) / sizeof(Word));
  memory->candidates = reinterpret_cast<Word*>(bytes + candidates_begin);
  memory->layer_face = reinterpret_cast<Index*>(memory->area);
  memory->layer_next = reinterpret_cast<Index*>(memory->candidates);
  memory->max_layers = min_of(static_cast<int32_t>((rows_begin - fragments_begin) / sizeof(Index)),
                              static_cast<int32_t>((layout.used - candidates_begin) / sizeof(Index)));
  // Most candidates become fragments. The fragments of a longer list would thus exceed max_fragments.
  memory->max_candidates = max_fragments + max_fragments / 2;
  return layout.used;
}

// Size of a block's state, which ends with the states of its warps.
__host__ __device__ constexpr size_t state_bytes(int threads) {
  return (sizeof(BlockState) - static_cast<size_t>(kMaxWarps - threads / kWarpSize) * sizeof(WarpState) + 15) / 16 * 16;
}

extern __shared__ __align__(16) unsigned char block_memory[];
__device__ inline BlockState* block_state() { return reinterpret_cast<BlockState*>(block_memory); }

/// Drawing memory in shared memory, at addresses known at compile time.
struct SmallDrawMemory : DrawMemory<uint16_t, uint32_t, kDrawThreads> {
  __host__ __device__ size_t place(unsigned char* bytes) { return lay_out(this, kDrawPixels, kDrawFragments, bytes); }
  __device__ static SmallDrawMemory current() {
    SmallDrawMemory memory;
    memory.place(block_memory + state_bytes(kDrawThreads));
    memory.state = block_state();
    memory.faces = memory.state->faces;
    memory.edges = memory.state->edges;
    return memory;
  }
};
static_assert(kMaxEntries <= kMaxMarkedFaces);
static_assert(kMaxMarkedFaces < 0xFFFF && kDrawFragments < 0xFFFF && kDrawPixels < 0x7FFF);

// Global memory that holds the lists of face set-up, and later the arrays for drawing.
__host__ __device__ inline size_t lay_out(SetupLists* lists, const Scratch& sizes, unsigned char* bytes) {
  lists->max_entries = FaceBatch::count_of(sizes.max_faces) * FaceBatch::kEntries;
  lists->max_clipped = sizes.max_faces;
  Layout layout{bytes};
  layout.place(&lists->clipped, lists->max_clipped);
  layout.place(&lists->entries, lists->max_entries);
  return layout.used;
}
struct LargeDrawMemory : DrawMemory<uint32_t, unsigned long long, kLargeThreads> {
  __host__ __device__ size_t place(unsigned char* bytes) { return lay_out(this, kLargePixels, kLargeFragments, bytes); }
  __device__ static LargeDrawMemory current() {
    LargeDrawMemory memory;
    memory.state = block_state();
    memory.place(memory.state->scratch.bytes);
    memory.faces = memory.state->faces;
    memory.edges = memory.state->edges;
    return memory;
  }
};

__host__ __device__ inline size_t draw_bytes() { return state_bytes(kDrawThreads) + SmallDrawMemory().place(nullptr); }
__host__ __device__ inline size_t large_bytes(const Scratch& sizes) {
  SetupLists lists;
  const size_t to_set_up = lay_out(&lists, sizes, nullptr), to_draw = LargeDrawMemory().place(nullptr);
  return ((to_set_up > to_draw ? to_set_up : to_draw) + 15) / 16 * 16;
}

// Collective over the block.
__device__ inline void claim_scratch(const Scratch& scratch) {
  if (threadIdx.x == 0) {
    Scratch own = scratch;
    own.faces += static_cast<size_t>(blockIdx.x) * static_cast<size_t>(scratch.max_faces);
    own.edges += static_cast<size_t>(blockIdx.x) * static_cast<size_t>(scratch.max_edges);
    own.bytes += blockIdx.x * large_bytes(scratch);
    block_state()->scratch = own;
  }
  sync_block();
}

}  // namespace pictura::cuda
