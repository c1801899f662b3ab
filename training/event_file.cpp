#include "pictura/training/event_file.h"

#include <cerrno>
#include <chrono>
#include <cstring>

#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/crc32c.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/protobuf_writer.h"

namespace pictura {

namespace {

double wall_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// Returns the google.protobuf.Value of a TOML value: a number, a truth value, or a text.
std::string value_of(const std::string& toml) {
  std::string value;
  if (const std::optional<double> number = parse_written_number(toml)) {
    append_double(2, *number, &value);
  } else if (toml == "true" || toml == "false") {
    append_integer(4, toml == "true" ? 1 : 0, &value);
  } else {
    const bool is_quoted = toml.size() > 1 && (toml.front() == '"' || toml.front() == '\'');
    append_bytes(3, is_quoted ? toml.substr(1, toml.size() - 2) : toml, &value);
  }
  return value;
}

// Summary.Value of a plugin of TensorBoard.
std::string plugin_value(const std::string& tag, const std::string& plugin, const std::string& content,
                         const std::string& tensor) {
  std::string data, metadata, value;
  append_bytes(1, plugin, &data);
  append_bytes(2, content, &data);
  append_bytes(1, data, &metadata);
  append_bytes(1, tag, &value);
  if (!tensor.empty()) append_bytes(8, tensor, &value);
  append_bytes(9, metadata, &value);
  return value;
}

// TensorProto of one text.
std::string text_tensor(const std::string& text) {
  std::string size, shape, tensor;
  append_integer(1, 1, &size);
  append_bytes(2, size, &shape);
  append_integer(1, 7, &tensor);  // DT_STRING
  append_bytes(2, shape, &tensor);
  append_bytes(8, text, &tensor);
  return tensor;
}

// Returns Markdown that shows a text unchanged.
std::string as_code(const std::string& text) {
  std::string code = "    ";
  for (const char letter : text) code += letter == '\n' ? "\n    " : std::string(1, letter);
  return code;
}

}  // namespace

EventFile::EventFile(const std::string& folder)
    : path_(fmt::format("{}/events.out.tfevents.{:.0f}.{}", folder, wall_time_s(), getpid())),
      out_(path_, std::ios::binary) {
  PICTURA_CHECK(out_, "{}: cannot be opened for writing", path_);
  std::string version;
  append_double(1, wall_time_s(), &version);
  append_bytes(3, "brain.Event:2", &version);
  write_record(version);
}

void EventFile::write(int64_t step, const Scalars& scalars) {
  std::string summary;
  for (const auto& [tag, value] : scalars) {
    std::string scalar;
    append_bytes(1, tag, &scalar);
    append_float(2, static_cast<float>(value), &scalar);
    append_bytes(1, scalar, &summary);
  }
  write_summary(step, summary);
}

void EventFile::write_configuration(const Settings& settings, const std::string& toml) {
  // HParamsPluginData and SessionStartInfo of TensorBoard's plugin_data.proto.
  std::string session, content, summary;
  for (const auto& [name, text] : settings) {
    if (text.starts_with('[')) continue;
    std::string entry;
    append_bytes(1, name, &entry);
    append_bytes(2, value_of(text), &entry);
    append_bytes(1, entry, &session);
  }
  append_double(5, wall_time_s(), &session);
  append_bytes(3, session, &content);
  append_bytes(1, plugin_value("_hparams_/session_start_info", "hparams", content, ""), &summary);
  append_bytes(1, plugin_value("configuration/text_summary", "text", "", text_tensor(as_code(toml))), &summary);
  write_summary(0, summary);
}

void EventFile::write_summary(int64_t step, const std::string& summary) {
  std::string event;
  append_double(1, wall_time_s(), &event);
  append_integer(2, static_cast<uint64_t>(step), &event);
  append_bytes(5, summary, &event);
  write_record(event);
}

void EventFile::write_record(const std::string& event) {
  const uint64_t size = event.size();
  const std::string_view length = bytes_of(size);
  const uint32_t length_crc = masked_crc32c(length), event_crc = masked_crc32c(event);
  out_ << length << bytes_of(length_crc) << event << bytes_of(event_crc) << std::flush;
  PICTURA_CHECK(out_, "{}: writing failed: {}", path_, std::strerror(errno));
}

}  // namespace pictura
