// Pretrained image network that replaces a policy's convolutions: a TorchScript program and its description, in a file
// that scripts/export_backbone wrote.
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
  /// Reads a program. `options` are the type and device of its weights. If `frozen`, the weights get no gradients.
  /// Throws Error, which names the file, if it does not exist or is not a file of scripts/export_backbone.
  ImageBackbone(const std::string& path, const at::TensorOptions& options, bool frozen);
  ~ImageBackbone();

  /// Number of channels of a feature map.
  int64_t channels() const;
  /// Hash of the file's bytes: 16 hexadecimal digits.
  const std::string& hash() const;
  /// Trained weights; their names are "image_backbone." followed by the name in the program. Empty if frozen.
  const std::vector<NamedTensor>& parameters() const;
  /// Throws Error, which names file and camera, if the program supports only one image size and a camera of the rig has
  /// another size.
  void check_images(const Rig& rig) const;

  /// Computes the feature maps of images. images: u8 [views, cameras, 3, height, width]; result: [cameras * views,
  /// channels, rows, columns], with channels last in memory. Each position of a map corresponds to one patch of the
  /// image. Images whose size is not a multiple of the patch size are padded with black at the right and the bottom.
  at::Tensor forward(const at::Tensor& images) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
