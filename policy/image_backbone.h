// Pretrained image network in place of the convolutions: a TorchScript program that scripts/export_backbone wrote, with
// its description.
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
  /// Reads a program, with its weights in the type and on the device of `options`. Frozen weights get no gradients.
  /// Throws Error naming the file if it does not exist or is not such a program.
  ImageBackbone(const std::string& path, const at::TensorOptions& options, bool frozen);
  ~ImageBackbone();

  /// Channels of a feature map.
  int64_t channels() const;
  /// 16 hexadecimal digits over the file's bytes.
  const std::string& hash() const;
  /// Trained weights, named "image_backbone." and their name in the program; empty if frozen.
  const std::vector<NamedTensor>& parameters() const;
  /// Throws Error naming file and camera if the program takes images of one size only and this camera has another size.
  void check_images(const Rig& rig) const;

  /// Computes feature maps of images, u8 [views, cameras, 3, height, width]: [cameras * views, channels, rows,
  /// columns], a row and a column for each patch, channels last in memory. Images that the patches do not divide are
  /// padded with black at the right and the bottom.
  at::Tensor forward(const at::Tensor& images) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
