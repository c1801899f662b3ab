// The bytes of a replay: whole numbers as differences of varying length, zlib streams, and base64 for text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Appends a number in groups of 7 bits, the lowest first; small ones of either sign are short.
void put_number(int32_t value, std::string* bytes_inout);

/// Reads what put_number wrote. Throws Error where the bytes end, or hold no such number.
class NumberReader {
 public:
  explicit NumberReader(std::string_view bytes) : bytes_(bytes) {}
  int32_t next();
  /// A number that counts things of which each takes at least one byte.
  int32_t next_count();
  bool is_at_end() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

/// Numbers by the differences of their order, 0 to 2: first, stride apart. The first is one from 0.
void put_differences(const int32_t* first, std::size_t count, std::size_t stride, int order, std::string* bytes_inout);
void read_differences(NumberReader* reader, std::size_t count, std::size_t stride, int order, int32_t* first_out);

/// A zlib stream, and back to exactly `size` bytes. Throws Error where the stream is damaged or of another length.
std::string deflate(std::string_view bytes);
std::string inflate(std::string_view stream, std::size_t size);

std::string base64(std::string_view bytes);
/// Throws Error where the text is not what base64() writes.
std::string from_base64(std::string_view text);

}  // namespace pictura
