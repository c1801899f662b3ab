// Pretrained image network that replaces a policy's convolutions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/camera.h"

namespace pictura {

struct NamedTensor;

class ImageBackbone {
 public:
  /// Reads a TorchScript program of scripts/export_backbone. options: type and device of its weights, which get no
  /// gradients if `frozen`. Throws Error naming the file if it is not such a file.
  ImageBackbone(const std::string& path, const at::TensorOptions& options, bool frozen);
  ~ImageBackbone();

  /// Channels of a feature map.
  int64_t channels() const;
  /// Hash of the file: 16 hexadecimal digits.
  const std::string& hash() const;
  /// Trained weights, empty if frozen. Each name is "image_backbone." followed by the name in the program.
  const std::vector<NamedTensor>& parameters() const;
  /// Throws Error naming file and camera if the program supports one image size and a camera has another.
  void check_images(const Rig& rig) const;

  /// Returns feature maps [cameras * views, channels, rows, columns], channels last in memory, with one position per
  /// patch. images: u8 [views, cameras, 3, height, width]; black pixels are added at the right and the bottom to
  /// complete patches.
  at::Tensor forward(const at::Tensor& images) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
