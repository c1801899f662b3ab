// Encodings that replay files use: whole numbers of variable length and their differences, zlib streams, and base64
// text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Appends a number in groups of 7 bits, the lowest group first. Numbers of small magnitude take few bytes.
void put_number(int32_t value, std::string* bytes_inout);

/// Reads numbers that put_number() wrote. Throws Error if the bytes end within a number, or if put_number() cannot have
/// written them.
class NumberReader {
 public:
  explicit NumberReader(std::string_view bytes) : bytes_(bytes) {}
  int32_t next();
  /// Reads a count of items. Throws Error if it exceeds the remaining bytes, because each item takes at least one byte.
  int32_t next_count();
  bool is_at_end() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

/// Writes `count` numbers as differences of order 0 to 2. The numbers begin at `first` and are `stride` apart. The
/// number before the first counts as 0.
void put_differences(const int32_t* first, std::size_t count, std::size_t stride, int order, std::string* bytes_inout);
/// Reads the numbers that put_differences() wrote with the same count and order.
void read_differences(NumberReader* reader, std::size_t count, std::size_t stride, int order, int32_t* first_out);

/// Compresses bytes to a zlib stream.
std::string deflate(std::string_view bytes);
/// Decompresses a zlib stream of exactly `size` bytes. Throws Error if the stream is damaged or has another size.
std::string inflate(std::string_view stream, std::size_t size);

std::string base64(std::string_view bytes);
/// Decodes base64. Throws Error if base64() cannot have written the text.
std::string from_base64(std::string_view text);

}  // namespace pictura
