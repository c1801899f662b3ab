// Non-owning pointer and length, for host and CUDA code. Lengths and indices may have any integer type.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

template <typename T>
class Span {
 public:
  constexpr Span() = default;
  template <typename Integer>
  PICTURA_HD constexpr Span(T* data, Integer size) : data_(data), size_(static_cast<size_t>(size)) {}
  template <typename Container>
    requires requires(Container& c, T*& p) {
      p = c.data();
      c.size();
    }
  PICTURA_HD constexpr Span(Container& container) : data_(container.data()), size_(container.size()) {}
  template <typename Container>
    requires requires(const Container& c, T*& p) {
      p = c.data();
      c.size();
    }
  PICTURA_HD constexpr Span(const Container& container) : data_(container.data()), size_(container.size()) {}

  template <typename Integer>
  PICTURA_HD constexpr T& operator[](Integer i) const {
    return data_[i];
  }
  PICTURA_HD constexpr T* data() const { return data_; }
  PICTURA_HD constexpr size_t size() const { return size_; }
  PICTURA_HD constexpr bool empty() const { return size_ == 0; }
  PICTURA_HD constexpr T* begin() const { return data_; }
  PICTURA_HD constexpr T* end() const { return data_ + size_; }
  PICTURA_HD constexpr Span subspan(size_t begin, size_t count) const { return {data_ + begin, count}; }

 private:
  T* data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace pictura
