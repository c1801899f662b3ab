// Strict reader of TOML: code asks for each key by name, type and range, and all other keys are errors. Messages name
// the file, the line, the table and the key. This header is not installed, so that users of the library do not need
// toml++.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "pictura/common/camera.h"
#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Parses a TOML text. Throws Error naming source and line.
toml::table parse_toml(const std::string& text, const std::string& source);

/// Returns the integer of a value in any notation: 1e3 and 1000.0 equal 1000. Nothing for other values.
std::optional<int64_t> whole_number(const toml::node& node);

/// Formats a value for messages, in one short line.
std::string format_value(const toml::node& node);

/// Reader of one table. If a key is missing, functions with a fallback return the fallback, and other functions throw
/// Error. All functions throw Error for a wrong type or range. The table must outlive the object.
class TomlFields {
 public:
  struct Range {
    double low, high;  // both included
  };

  /// `name` is the table's name in messages, such as "camera 2"; empty for the whole file.
  TomlFields(const toml::table& table, std::string source, std::string name = "");

  /// Changes the table's name in messages.
  void rename(std::string name) { name_ = std::move(name); }
  bool has(std::string_view key) { return find(key) != nullptr; }
  float number(std::string_view key, Range range);
  float number(std::string_view key, Range range, float fallback);
  int integer(std::string_view key, Range range);
  int integer(std::string_view key, Range range, int fallback);
  bool flag(std::string_view key, bool fallback);
  std::string text(std::string_view key, const std::string& fallback);
  /// Reads a text that may be part of a file name: at most 64 letters, digits, '-' and '_'.
  std::string file_name(std::string_view key, const std::string& fallback);
  /// Reads a text and returns its index in `names`. A fallback of -1 makes the key mandatory.
  int choice(std::string_view key, Span<const std::string_view> names, int fallback = -1);
  /// Reads a list of `size` numbers.
  std::vector<float> numbers(std::string_view key, Range range, std::size_t size);
  std::vector<int> integers(std::string_view key, Range range, std::vector<int> fallback);
  /// Reads a list of at least `minimum` points [x, y] (z is 0) or [x, y, z].
  std::vector<Vec3> points(std::string_view key, Range range, std::size_t minimum);
  /// Returns the [[key]] tables; empty if there are none.
  std::vector<TomlFields> tables(std::string_view key);

  /// Throws Error for the first key that was not read. Call it after reading all keys.
  void reject_unknown_keys() const;
  /// Throws an Error "file:line: table: key: message".
  [[noreturn]] void throw_error(std::string_view key, std::string_view message) const;

 private:
  const toml::node* find(std::string_view key);  // also records the key as known
  const toml::node& require(std::string_view key);
  int integer_of(std::string_view key, const toml::node& node, Range range) const;
  float number_of(std::string_view key, const toml::node& node, Range range) const;
  const toml::array& list_of(std::string_view key, const toml::node& node) const;
  [[noreturn]] void throw_error(std::string_view key, const toml::node& node, std::string_view expected) const;

  const toml::table* table_;
  std::string source_, name_;
  std::vector<std::string> known_;
};

/// Reads the rig of the [[camera]] tables (docs/explanation/image.md); without tables, the rig has no cameras.
Rig read_cameras(TomlFields* fields_inout);

}  // namespace pictura
