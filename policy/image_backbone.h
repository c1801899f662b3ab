// A pretrained image network in the place of the convolutions: a TorchScript program that scripts/export_backbone
// wrote, and what that says of it.
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
  /// Reads a program, with its weights in the type and on the device of `options`. Frozen, they get no gradients.
  /// Throws Error naming the file where there is none or it is no such program.
  ImageBackbone(const std::string& path, const at::TensorOptions& options, bool frozen);
  ~ImageBackbone();

  /// Of a feature map.
  int64_t channels() const;
  /// 16 hexadecimal digits over the file's bytes.
  const std::string& hash() const;
  /// Its weights, where they are trained, by their names in the program after "image_backbone.".
  const std::vector<NamedTensor>& parameters() const;
  /// Throws Error naming file and camera where the program takes images of one size alone, and this one is another.
  void check_images(const Rig& rig) const;

  /// Feature maps of images, u8 [views, cameras, 3, height, width]: [cameras * views, channels, rows, columns], a row
  /// and a column for each patch, channels last in memory. Images that the patches do not divide are filled up with
  /// black at the right and the bottom.
  at::Tensor forward(const at::Tensor& images) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
