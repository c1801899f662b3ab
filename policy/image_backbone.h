// Pretrained image network that replaces the convolutions: a TorchScript program with its description, written by
// scripts/export_backbone.
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
  /// Throws Error naming the file if it does not exist or is not a program of scripts/export_backbone.
  ImageBackbone(const std::string& path, const at::TensorOptions& options, bool frozen);
  ~ImageBackbone();

  /// Channels of a feature map.
  int64_t channels() const;
  /// Hash of the file's bytes: 16 hexadecimal digits.
  const std::string& hash() const;
  /// Trained weights; their names are "image_backbone." followed by the name in the program. Empty if frozen.
  const std::vector<NamedTensor>& parameters() const;
  /// Throws Error naming file and camera if the program supports only one image size and a camera of the rig has
  /// another size.
  void check_images(const Rig& rig) const;

  /// Computes feature maps, [cameras * views, channels, rows, columns] with channels last in memory, of images, u8
  /// [views, cameras, 3, height, width]. Each position of the map belongs to one patch of the image. Images whose size
  /// is no multiple of the patch size are padded with black at the right and the bottom.
  at::Tensor forward(const at::Tensor& images) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
