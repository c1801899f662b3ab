#include "pictura/training/kept_images.h"

#include <algorithm>

namespace pictura {

KeptImages::KeptImages(const Rig& rig, int64_t num_steps, int64_t num_slots, int64_t capacity, Device device)
    : images_(allocate_images(rig, {capacity}, device)),
      place_of_row_(at::zeros({num_steps, num_slots}, images_.at(0).pixels.options().dtype(at::kLong))) {}

void KeptImages::put(int64_t step, const at::Tensor& slots, const std::vector<ImageBlock>& images) {
  if (step == 0) count_ = 0;
  const int64_t first = count_, capacity = images_[0].pixels.size(0);
  count_ += slots.size(0);
  if (count_ > capacity) {
    ++generation_;
    for (ImageBlock& block : images_) {
      const at::Tensor before = block.pixels.narrow(0, 0, first);
      std::vector<int64_t> shape = block.pixels.sizes().vec();
      shape[0] = std::max(count_, capacity + capacity / 4);
      block.pixels = at::empty(shape, before.options());
      block.pixels.narrow(0, 0, first).copy_(before);
    }
  }
  for (size_t i = 0; i < images.size(); ++i) {
    images_[i].pixels.narrow(0, first, slots.size(0)).copy_(images[i].pixels);
  }
  place_of_row_.select(0, step).index_copy_(0, slots, at::arange(first, count_, slots.options()));
}

std::vector<ImageBlock> KeptImages::gather(const at::Tensor& rows) const {
  const at::Tensor places = place_of_row_.flatten().index_select(0, rows);
  std::vector<ImageBlock> gathered = images_;
  for (ImageBlock& block : gathered) block.pixels = block.pixels.index_select(0, places);
  return gathered;
}

}  // namespace pictura
