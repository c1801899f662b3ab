// A renderer that runs the CUDA renderer's kernels on the host, in a random order of threads.
#pragma once

#include <memory>
#include <vector>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/common/renderer.h"

namespace pictura::test {

/// Launches have only two blocks, so that each block draws several images.
class EmulatedRenderer final : public Renderer {
 public:
  /// Capacity of the pool per image.
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
  /// Throws the last call's fault.
  void poll() override;
  void check(Stream stream = {}) override;

  /// Numbers of overflow images and deferred images of the last call.
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
  std::vector<std::unique_ptr<Map>> maps_;        // [handle]; null: no map
  std::vector<cuda::DeviceGeometry> geometries_;  // [handle]
  cuda::FaultWord fault_ = cuda::kNoFault;
  int overflow_ = 0, deferred_ = 0;
};

}  // namespace pictura::test
