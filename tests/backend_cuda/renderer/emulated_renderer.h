// A renderer whose kernels, the text of the CUDA renderer's, run thread by thread on the host.
#pragma once

#include <memory>
#include <vector>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/common/renderer.h"

namespace pictura::test {

/// Draws with the kernels. Two blocks of each launch, so that each draws several images, one after the other. Its
/// threads take turns in an order that a seed draws.
class EmulatedRenderer final : public Renderer {
 public:
  /// Room in the pool, for an image.
  struct Pool {
    std::size_t faces = 2048, clipped_edges = 4096;
  };
  EmulatedRenderer(const RendererConfig& config, uint64_t seed);
  EmulatedRenderer(const RendererConfig& config, uint64_t seed, const Pool& pool);
  ~EmulatedRenderer() override;
  std::string_view name() const override { return "emulated"; }
  Device device() const override { return {}; }
  const RendererConfig& config() const override { return config_; }
  void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream stream = {}) override;
  void release(GeometryHandle handle, Stream stream = {}) override;
  void render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out, Stream stream) override;
  void visibility(const SceneBatch& scene, const ViewBatch& views, Span<const VisibilityQuery> queries,
                  Span<float> visibility_out, Stream stream) override;
  /// Throws what the last call found wrong.
  void poll() override;
  void check(Stream stream = {}) override;

  /// Images that the last call left to the last launch, and for which the pool had no room.
  int overflow() const { return overflow_; }
  int deferred() const { return deferred_; }

 private:
  struct Map;
  struct Setup;

  template <typename Kernel>
  void launch(int threads, unsigned blocks, Kernel&& kernel) const;

  RendererConfig config_;
  uint64_t seed_;
  Pool pool_;
  std::vector<PinholeCamera> cameras_;
  std::vector<std::unique_ptr<Map>> maps_;        // [handle], null where it holds none
  std::vector<cuda::DeviceGeometry> geometries_;  // [handle]
  cuda::FaultWord fault_ = cuda::kNoFault;
  int overflow_ = 0, deferred_ = 0;
};

}  // namespace pictura::test
