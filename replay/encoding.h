// Encodings of replay files.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Appends a number in groups of 7 bits, lowest first. Small magnitudes take few bytes.
void put_number(int32_t value, std::string* bytes_inout);

/// Reads numbers of put_number(). Throws Error for other or incomplete bytes.
class NumberReader {
 public:
  explicit NumberReader(std::string_view bytes) : bytes_(bytes) {}
  int32_t next();
  /// Throws Error if the count exceeds the remaining bytes, because each item takes at least one.
  int32_t next_count();
  bool is_at_end() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

/// Writes numbers from `first` on, `stride` apart, as differences of order 0 to 2. The number before the first counts
/// as 0.
void put_differences(const int32_t* first, std::size_t count, std::size_t stride, int order, std::string* bytes_inout);
/// Inverse of put_differences() with the same count and order.
void read_differences(NumberReader* reader, std::size_t count, std::size_t stride, int order, int32_t* first_out);

std::string deflate(std::string_view bytes);
/// Throws Error if the zlib stream is damaged or has another size.
std::string inflate(std::string_view stream, std::size_t size);

std::string base64(std::string_view bytes);
/// Throws Error if base64() cannot have written the text.
std::string from_base64(std::string_view text);

}  // namespace pictura
