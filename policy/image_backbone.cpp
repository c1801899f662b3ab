#include "pictura/policy/image_backbone.h"

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <torch/csrc/jit/runtime/graph_executor.h>
#include <torch/csrc/jit/serialization/import.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/json.h"
#include "pictura/policy/layers.h"
#include "pictura/policy/policy.h"

namespace pictura {

namespace {

constexpr const char* kDescription = "pictura_backbone.json";  // name of the description in the program's file
constexpr const char* kBackboneFormat = "pictura backbone 1";

// Returns the first line of a torch error, which a stack trace follows.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

// Returns the last line of a program's error, which follows a stack trace.
std::string last_line(std::string text) {
  text.erase(text.find_last_not_of(" \n") + 1);
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace

struct ImageBackbone::Parts {
  std::string path, hash;
  torch::jit::Module program;
  int64_t patch_px = 0, channels = 0;
  int64_t width_px = 0, height_px = 0;  // the only size that the program supports; 0: all multiples of the patch size
  at::ScalarType type = at::kFloat;
  bool frozen = true;
  std::vector<NamedTensor> parameters;

  int64_t filled_up(int64_t size_px) const { return (size_px + patch_px - 1) / patch_px * patch_px; }

  void read_description(const std::string& text) {
    try {
      const nlohmann::json json = parse_json<nlohmann::json>(text);
      PICTURA_CHECK(json.value("format", "") == kBackboneFormat, "expected \"format\": \"{}\"", kBackboneFormat);
      json.at("patch_px").get_to(patch_px);
      json.at("channels").get_to(channels);
      if (const nlohmann::json& size = json.at("size_px"); !size.is_null()) {
        size.at(0).get_to(width_px);
        size.at(1).get_to(height_px);
      }
      PICTURA_CHECK(patch_px > 0 && channels > 0, "expected a patch and channels of 1 or more, got {} and {}", patch_px,
                    channels);
    } catch (const std::exception& error) {
      fail("{}: {}: {}", path, kDescription, error.what());
    }
  }
};

ImageBackbone::ImageBackbone(const std::string& path, const at::TensorOptions& options, bool frozen)
    : parts_(std::make_unique<Parts>()) {
  parts_->path = path;
  parts_->type = options.dtype().toScalarType();
  parts_->frozen = frozen;
  Hash64 hash;
  {
    const std::string bytes = read_file(path, size_t{1} << 36);
    hash.add_bytes(bytes.data(), bytes.size());
  }
  parts_->hash = hash.hex();
  torch::jit::ExtraFilesMap files{{kDescription, ""}};
  try {
    parts_->program = torch::jit::load(path, options.device(), files);
  } catch (const std::exception& error) {
    fail("{}: expected a TorchScript program written by scripts/export_backbone: {}", path, first_line(error.what()));
  }
  PICTURA_CHECK(!files[kDescription].empty(),
                "{}: a TorchScript program without {}: expected a program written by scripts/export_backbone", path,
                kDescription);
  parts_->read_description(files[kDescription]);
  parts_->program.to(options.device(), parts_->type);
  parts_->program.eval();
  for (const auto& [name, value] : parts_->program.named_parameters()) {
    value.set_requires_grad(!frozen);
    if (!frozen) parts_->parameters.push_back({"image_backbone." + name, value});
  }
  PICTURA_CHECK(frozen || !parts_->parameters.empty(),
                "{}: has no parameters to train: set policy.backbone_frozen to true", path);
}

ImageBackbone::~ImageBackbone() = default;

int64_t ImageBackbone::channels() const { return parts_->channels; }

const std::string& ImageBackbone::hash() const { return parts_->hash; }

const std::vector<NamedTensor>& ImageBackbone::parameters() const { return parts_->parameters; }

void ImageBackbone::check_images(const Rig& rig) const {
  if (parts_->width_px == 0) return;
  for (const Camera& camera : rig.cameras) {
    PICTURA_CHECK(parts_->filled_up(camera.width_px) == parts_->width_px &&
                      parts_->filled_up(camera.height_px) == parts_->height_px,
                  "{}: was traced only for images of {}x{}, with patches of {}: camera '{}' has {}x{}", parts_->path,
                  parts_->width_px, parts_->height_px, parts_->patch_px, camera.name, camera.width_px,
                  camera.height_px);
  }
}

at::Tensor ImageBackbone::forward(const at::Tensor& images) const {
  // image_patches() may pad images with further channels, which are 0.
  const at::Tensor pixels = image_patches(images, /*patch_px=*/1, parts_->type).narrow(1, 0, 3) / 255.0;
  const int64_t height = pixels.size(2), width = pixels.size(3), patch = parts_->patch_px;
  const at::Tensor whole =
      at::constant_pad_nd(pixels, {0, parts_->filled_up(width) - width, 0, parts_->filled_up(height) - height});
  // Torch's optimizer of programs would specialise the program for the inputs of earlier calls, so that equal calls
  // could give different bits.
  const torch::jit::GraphOptimizerEnabledGuard no_optimizer(false);
  const bool needs_grad = at::GradMode::is_enabled() && !parts_->frozen;
  const at::AutoGradMode grad(needs_grad);
  at::Tensor features;
  try {
    features = parts_->program.get_method("forward")({whole}).toTensor();
  } catch (const std::exception& error) {
    fail("{}: cannot run on images of {}x{}: {}", parts_->path, whole.size(3), whole.size(2), last_line(error.what()));
  }
  const std::vector<int64_t> expected{whole.size(0), parts_->channels, whole.size(2) / patch, whole.size(3) / patch};
  PICTURA_CHECK(features.sizes() == at::IntArrayRef(expected), "{}: expected a feature map of {}, got {}", parts_->path,
                fmt::join(expected, " x "), fmt::join(features.sizes(), " x "));
  return features.contiguous(at::MemoryFormat::ChannelsLast);
}

}  // namespace pictura
