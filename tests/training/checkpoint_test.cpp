// Files of runs: checkpoints, which are read completely or rejected with an error that names the file; safetensors;
// TensorBoard records.
#include "pictura/training/checkpoint.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "pictura/common/error.h"
#include "pictura/common/support/crc32c.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/policy/session.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/training/event_file.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::HasSubstr;
using ::testing::Not;

class Folder : public ::testing::Test {
 protected:
  test::ScratchFolder folder_;
};

Config small_config() {
  Config config;
  config.policy.modality = Modality::vector;
  config.policy.embedding_width = 4;
  config.policy.backbone_width = 8;
  return config;
}

Checkpoint small_checkpoint(const Policy& policy, const Config& config) {
  Checkpoint c;
  c.config = config;
  c.rig = paper_rig(16, 9);
  c.update = 12;
  c.agent_steps = 3456;
  c.distance_m = 7.25;
  c.adam_steps = 24;
  c.filter_average = 0.1234567890123;
  c.recent = {{2, -4.123456789012345}, {6, 8}};
  c.longest_update_s = {{"host, 8 agents", 0.123456789012345}};
  c.parameters = policy.parameters();
  for (const NamedTensor& p : policy.parameters()) {
    c.first_moments.push_back({p.name, at::full_like(p.value, 1.5)});
    c.second_moments.push_back({p.name, at::full_like(p.value, 2.5)});
  }
  c.simulator = {1, 2, 3, 255};
  return c;
}

using CheckpointFile = Folder;

constexpr size_t kPreamble = 24, kHashBytes = 8;

size_t header_bytes_of(const std::string& file) {
  uint64_t header_bytes = 0;
  std::memcpy(&header_bytes, file.data() + 16, sizeof header_bytes);
  return header_bytes;
}

// Returns the file with a hash that matches its bytes.
std::string sealed(std::string file) {
  const uint64_t hash = hash_of(std::string_view(file).substr(0, file.size() - kHashBytes));
  std::memcpy(file.data() + file.size() - kHashBytes, &hash, kHashBytes);
  return file;
}

nlohmann::ordered_json header_of(const std::string& file) {
  return nlohmann::ordered_json::parse(file.substr(kPreamble, header_bytes_of(file)));
}

// Returns a file of version 1, with the hash of only the data in its header.
std::string as_version_1(const std::string& file, nlohmann::ordered_json header, const std::string& data) {
  header["data"] = {{"bytes", data.size()}, {"hash", fmt::format("{:016x}", hash_of(data))}};
  const std::string text = header.dump();
  const uint32_t version = 1;
  const uint64_t size = text.size();
  std::string preamble = file.substr(0, kPreamble);
  std::memcpy(preamble.data() + 8, &version, sizeof version);
  std::memcpy(preamble.data() + 16, &size, sizeof size);
  return preamble + text + data;
}

// Returns the checkpoint as version 1 wrote it.
std::string as_version_1(const std::string& file) {
  const size_t data_begin = kPreamble + header_bytes_of(file);
  return as_version_1(file, header_of(file), file.substr(data_begin, file.size() - data_begin - kHashBytes));
}

TEST_F(CheckpointFile, ReadsBackEqual) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  write_checkpoint(folder_ / "a.ckpt", small_checkpoint(policy, config));
  const Checkpoint back = read_checkpoint(folder_ / "a.ckpt");
  EXPECT_EQ(to_toml(back.config), to_toml(config));
  EXPECT_EQ(back.update, 12);
  EXPECT_EQ(back.agent_steps, 3456);
  EXPECT_EQ(back.distance_m, 7.25);
  EXPECT_EQ(back.adam_steps, 24);
  EXPECT_EQ(back.filter_average, 0.1234567890123);
  ASSERT_EQ(back.recent.size(), 2u);
  EXPECT_EQ(back.recent[0].finished, 2);
  EXPECT_EQ(back.recent[0].finished_return, -4.123456789012345);
  EXPECT_EQ(back.recent[1].finished_return, 8);
  EXPECT_EQ(back.longest_update_s, (std::map<std::string, double>{{"host, 8 agents", 0.123456789012345}}));
  EXPECT_EQ(first_difference(back.rig, paper_rig(16, 9)), "");
  EXPECT_EQ(back.simulator, (std::vector<uint8_t>{1, 2, 3, 255}));
  ASSERT_EQ(back.rig.cameras.size(), 4u);
  EXPECT_EQ(back.rig.cameras[1].yaw_rad, paper_rig(16, 9).cameras[1].yaw_rad);
  EXPECT_EQ(back.rig.cameras[3].focal_y_px, paper_rig(16, 9).cameras[3].focal_y_px);

  const PolicyNetwork other(config.policy, 4, 2);
  EXPECT_NE(other.hash(), policy.hash());
  restore_tensors("a.ckpt", back.parameters, other.parameters());
  EXPECT_EQ(other.hash(), policy.hash());
  EXPECT_EQ(back.second_moments[3].value.flatten()[0].item<float>(), 2.5f);
}

TEST_F(CheckpointFile, ErrorsNameOtherArchitectures) {
  Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  write_checkpoint(folder_ / "a.ckpt", small_checkpoint(policy, config));
  const Checkpoint saved = read_checkpoint(folder_ / "a.ckpt");
  config.policy.backbone_width = 16;
  const PolicyNetwork wider(config.policy, 4, 1);
  const std::string wide = message_of([&] { restore_tensors(saved.path, saved.parameters, wider.parameters()); });
  EXPECT_THAT(wide, ::testing::AllOf(HasSubstr("a.ckpt"), HasSubstr("backbone.0.weight"), HasSubstr("[16, 24]"),
                                     HasSubstr("[8, 24]")));
  config = small_config();
  config.policy.modality = Modality::perspective;
  const PolicyNetwork seeing(config.policy, 4, 1);
  EXPECT_THAT(message_of([&] { restore_tensors(saved.path, saved.parameters, seeing.parameters()); }),
              HasSubstr("no parameter 'conv.0.weight'"));
}

TEST_F(CheckpointFile, ErrorsNameNonFiniteWeights) {
  const Config config = small_config();
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    const PolicyNetwork policy(config.policy, 4, 1);
    at::Tensor weight = policy.parameters()[3].value.detach();
    weight.flatten()[1] = bad;
    write_checkpoint(folder_ / "a.ckpt", small_checkpoint(policy, config));
    const auto is_named =
        ::testing::AllOf(HasSubstr("a.ckpt"), HasSubstr("'" + policy.parameters()[3].name + "'"), HasSubstr("finite"));
    EXPECT_THAT(message_of([&] { PolicySession(folder_ / "a.ckpt"); }), is_named);
    EXPECT_THAT(message_of([&] { export_policy(folder_ / "a.ckpt", folder_ / "a.safetensors", {}); }), is_named);
  }
}

TEST(Rigs, DifferencesAreNamed) {
  const Rig saved = paper_rig(16, 9);
  Rig now = saved;
  now.cameras[2].yaw_rad += 0.25f;
  EXPECT_THAT(first_difference(saved, now),
              ::testing::AllOf(HasSubstr("'" + saved.cameras[2].name + "'"), HasSubstr("yaw_pitch_roll_rad")));
  now = saved;
  now.cameras[0].focal_x_px = std::nextafter(now.cameras[0].focal_x_px, 1e9f);
  EXPECT_THAT(first_difference(saved, now), HasSubstr("focal_px"));
  now.cameras.pop_back();
  EXPECT_EQ(first_difference(saved, now), "4 cameras became 3");
}

TEST_F(CheckpointFile, EndlessFilesAreRefusedByTheirHeader) {
  EXPECT_THAT(message_of([] { read_policy("/dev/zero"); }), HasSubstr("/dev/zero: expected a checkpoint"));
  EXPECT_THAT(message_of([] { read_checkpoint("/dev/urandom"); }), HasSubstr("/dev/urandom: expected a checkpoint"));
}

TEST_F(CheckpointFile, BrokenFilesAreRefused) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  const std::string path = folder_ / "a.ckpt", broken = folder_ / "b.ckpt";
  write_checkpoint(path, small_checkpoint(policy, config));
  const std::string whole = read_file(path);
  auto refuse = [&](const std::string& bytes) {
    write_file(broken, bytes);
    return message_of([&] { read_checkpoint(broken); });
  };
  // At every length the error names the file, and no other error occurs.
  for (size_t size = 0; size < whole.size(); size += 97) {
    EXPECT_THAT(refuse(whole.substr(0, size)), HasSubstr("b.ckpt")) << size;
  }
  EXPECT_THAT(refuse(whole.substr(0, whole.size() - 1)), HasSubstr("truncated"));
  EXPECT_THAT(refuse("hello, this is no checkpoint at all"), HasSubstr("expected a checkpoint"));
  std::string changed = whole;
  changed[whole.size() - 20] = static_cast<char>(changed[whole.size() - 20] ^ 1);
  EXPECT_THAT(refuse(changed), HasSubstr("damaged"));
  changed = as_version_1(whole);
  changed[changed.size() - 20] = static_cast<char>(changed[changed.size() - 20] ^ 1);
  EXPECT_THAT(refuse(changed), HasSubstr("damaged"));
  EXPECT_THAT(refuse(as_version_1(whole).substr(0, whole.size() - 100)), HasSubstr("truncated"));
  nlohmann::ordered_json header = header_of(whole);
  header["parameters"][0]["shape"] = nlohmann::ordered_json::array();
  EXPECT_THAT(refuse(as_version_1(whole, header, "ab")), HasSubstr("parameters: bad")) << "a number has four bytes";
  changed = whole;
  changed[8] = 9;
  EXPECT_THAT(refuse(changed), HasSubstr("version"));
  changed = whole;
  std::swap(changed[12], changed[15]);
  EXPECT_THAT(refuse(changed), HasSubstr("byte order"));
  changed = whole;
  changed.replace(changed.find("\"lanes\":[80,7]"), 14, "\"lanes\":[80,8]");
  EXPECT_THAT(refuse(sealed(changed)),
              ::testing::AllOf(HasSubstr("observation schema: lanes"), HasSubstr("[80,7]"), HasSubstr("[80,8]")));
  changed = whole;
  changed[30] = '}';
  EXPECT_THAT(refuse(sealed(changed)), HasSubstr("header"));
  EXPECT_THAT(message_of([&] { PolicySession(folder_ / "none.ckpt"); }), HasSubstr("no such file"));
}

TEST_F(CheckpointFile, AnyFlippedBitIsRefused) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  const std::string path = folder_ / "a.ckpt";
  write_checkpoint(path, small_checkpoint(policy, config));
  const std::string whole = read_file(path);
  const size_t data_begin = kPreamble + header_bytes_of(whole), end = whole.size() - kHashBytes;
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const auto put = [&](size_t byte, char value) { file.seekp(static_cast<std::streamoff>(byte)).put(value).flush(); };
  const auto refuse = [&](size_t byte, int bit) {
    put(byte, static_cast<char>(whole[byte] ^ (1 << bit)));
    EXPECT_THAT(message_of([&] { read_checkpoint(path); }), HasSubstr("a.ckpt")) << "bit " << bit << " of " << byte;
    put(byte, whole[byte]);
  };
  for (size_t byte = 0; byte < kPreamble; ++byte) {
    for (int bit = 0; bit < 8; ++bit) refuse(byte, bit);
  }
  for (size_t byte = kPreamble; byte < data_begin; byte += 7) refuse(byte, static_cast<int>(byte % 8));
  for (size_t byte = data_begin; byte < end; byte += 211) refuse(byte, static_cast<int>(byte % 8));
  for (size_t byte = end; byte < whole.size(); ++byte) refuse(byte, static_cast<int>(byte % 8));
  EXPECT_NO_THROW(read_checkpoint(path));
}

TEST_F(CheckpointFile, Version1IsRead) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  const std::string path = folder_ / "a.ckpt";
  write_checkpoint(path, small_checkpoint(policy, config));
  write_file(path, as_version_1(read_file(path)));
  const Checkpoint back = read_checkpoint(path);
  EXPECT_EQ(back.update, 12);
  EXPECT_EQ(back.simulator, (std::vector<uint8_t>{1, 2, 3, 255}));
  const PolicyNetwork other(config.policy, 4, 2);
  restore_tensors("a.ckpt", back.parameters, other.parameters());
  EXPECT_EQ(other.hash(), policy.hash());
}

TEST_F(CheckpointFile, TheSchemaListsTheArraysOfThePolicy) {
  Config config = small_config();
  const std::string path = folder_ / "a.ckpt";
  auto schema_of = [&] {
    write_checkpoint(path, small_checkpoint(*make_policy(config, paper_rig(16, 9), Device{}), config));
    const std::string bytes = read_file(path);
    return nlohmann::json::parse(bytes.substr(kPreamble, header_bytes_of(bytes))).at("schema");
  };
  const nlohmann::json without_walls = schema_of();
  EXPECT_EQ(without_walls.at("partners"), nlohmann::json({16, 8}));
  EXPECT_EQ(without_walls.at("waypoints"), nlohmann::json({3, 3}));
  EXPECT_EQ(without_walls.at("ego"), nlohmann::json::array({9}));
  EXPECT_EQ(without_walls.at("actions"), nlohmann::json({4, 3}));
  EXPECT_EQ(without_walls.size(), 8u);
  config.simulator.wall_observations = true;
  const nlohmann::json with_walls = schema_of();
  EXPECT_EQ(with_walls.size(), 9u);
  EXPECT_EQ(with_walls.at("walls"), nlohmann::json({80, 7}));

  // A checkpoint without the array is rejected by the array's name.
  std::string changed = read_file(path);
  changed.replace(changed.find("\"walls\":[80,7]"), 7, "\"wells\"");
  write_file(path, sealed(changed));
  EXPECT_THAT(
      message_of([&] { read_checkpoint(path); }),
      ::testing::AllOf(HasSubstr("a.ckpt: observation schema: walls"), HasSubstr("[80,7]"), HasSubstr("no value")));
}

TEST_F(CheckpointFile, TheOldBackendKeyIsRead) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  const std::string path = folder_ / "a.ckpt";
  write_checkpoint(path, small_checkpoint(policy, config));
  std::string bytes = read_file(path);
  // Configuration of a run of versions that had only run.backend.
  const auto replace = [&](const std::string& from, std::string to) {
    const size_t at = bytes.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    ASSERT_LE(to.size(), from.size());
    to.resize(from.size(), ' ');
    bytes.replace(at, from.size(), to);
  };
  replace("device = 'auto'", "backend='null'");
  replace(R"([simulator]\nbackend = 'auto')", "[simulator]");
  replace(R"([render]\nbackend = 'auto'\nsamples = '1')", "[render]");
  write_file(path, sealed(bytes));
  const Checkpoint saved = read_checkpoint(path);
  EXPECT_EQ(saved.config.simulator.backend, "cpu");
  EXPECT_EQ(saved.config.render.backend, "null");
  EXPECT_EQ(saved.config.run.device, "auto");
}

TEST_F(CheckpointFile, SafetensorsHoldEveryParameter) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  write_safetensors(folder_ / "p.safetensors", policy.parameters(), to_toml(config));
  const std::string bytes = read_file(folder_ / "p.safetensors");
  uint64_t header_bytes = 0;
  std::memcpy(&header_bytes, bytes.data(), 8);
  EXPECT_EQ(header_bytes % 8, 0u);
  const auto header = nlohmann::json::parse(bytes.substr(8, header_bytes));
  EXPECT_EQ(header.size(), policy.parameters().size() + 1);
  size_t end = 0;
  for (const NamedTensor& p : policy.parameters()) {
    const auto& entry = header.at(p.name);
    EXPECT_EQ(entry.at("dtype"), "F32");
    EXPECT_EQ(entry.at("shape").get<std::vector<int64_t>>(), p.value.sizes().vec());
    const size_t begin = entry.at("data_offsets")[0];
    EXPECT_EQ(begin, end);
    end = entry.at("data_offsets")[1];
    EXPECT_EQ(0, std::memcmp(bytes.data() + 8 + header_bytes + begin, p.value.const_data_ptr(), end - begin)) << p.name;
  }
  EXPECT_EQ(8 + header_bytes + end, bytes.size());
}

TEST_F(CheckpointFile, SafetensorsAndCheckpointDriveIdentically) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  const Checkpoint checkpoint = small_checkpoint(policy, config);
  write_checkpoint(folder_ / "a.ckpt", checkpoint);
  const std::string path = folder_ / "a.safetensors";
  write_policy(path, checkpoint, WeightType::f32, "abc123");
  const SavedPolicy back = read_policy(path), from_checkpoint = read_policy(folder_ / "a.ckpt");
  EXPECT_EQ(to_toml(back.config), to_toml(config));
  EXPECT_EQ(first_difference(back.rig, checkpoint.rig), "");
  EXPECT_EQ(back.update, 12);
  EXPECT_EQ(back.agent_steps, 3456);
  EXPECT_EQ(hash_of_parameters(back.parameters), policy.hash());
  EXPECT_EQ(hash_of_parameters(from_checkpoint.parameters), policy.hash());
  EXPECT_EQ(PolicySession(path).policy_hash(), policy.hash());

  const ExportedPolicy half = export_policy(path, folder_ / "half.safetensors", {.commit = "abc123"});
  EXPECT_EQ(half.parameters, policy.num_parameters());
  EXPECT_LT(half.file_bytes, static_cast<int64_t>(std::filesystem::file_size(path)) - 19 * half.parameters / 10);
  const SavedPolicy rounded = read_policy(folder_ / "half.safetensors");
  EXPECT_EQ(half.policy_hash, hash_of_parameters(rounded.parameters));
  ASSERT_EQ(rounded.parameters.size(), policy.parameters().size());
  for (size_t i = 0; i < rounded.parameters.size(); ++i) {
    const NamedTensor &exact = policy.parameters()[i], &got = rounded.parameters[i];
    EXPECT_EQ(got.name, exact.name);
    EXPECT_TRUE(at::equal(got.value, exact.value.detach().to(at::kBFloat16).to(at::kFloat))) << got.name;
  }
}

TEST_F(CheckpointFile, AnyFlippedBitOfSafetensorsIsRefused) {
  const Config config = small_config();
  const PolicyNetwork policy(config.policy, 4, 1);
  const std::string path = folder_ / "a.safetensors", broken = folder_ / "b.safetensors";
  write_policy(path, small_checkpoint(policy, config), WeightType::bf16, "");
  const std::string whole = read_file(path);
  const auto refuse = [&](const std::string& bytes) {
    write_file(broken, bytes);
    return message_of([&] { read_policy(broken); });
  };
  uint64_t header_bytes = 0;
  std::memcpy(&header_bytes, whole.data(), sizeof header_bytes);
  const auto flip = [&](size_t byte, int bit) {
    std::string changed = whole;
    changed[byte] = static_cast<char>(changed[byte] ^ (1 << bit));
    EXPECT_THAT(refuse(changed), HasSubstr("b.safetensors")) << "bit " << bit << " of " << byte;
  };
  for (size_t byte = 0; byte < 8; ++byte) {
    for (int bit = 0; bit < 8; ++bit) flip(byte, bit);
  }
  for (size_t byte = 8; byte < 8 + header_bytes; byte += 11) flip(byte, static_cast<int>(byte % 8));
  for (size_t byte = 8 + header_bytes; byte < whole.size(); byte += 211) flip(byte, static_cast<int>(byte % 8));
  for (size_t size = 0; size < whole.size(); size += 97) {
    EXPECT_THAT(refuse(whole.substr(0, size)), HasSubstr("b.safetensors")) << size;
  }
  EXPECT_THAT(refuse("neither of them, but long enough"), HasSubstr("expected a checkpoint"));
  write_safetensors(broken, policy.parameters(), to_toml(config));
  EXPECT_THAT(message_of([&] { read_policy(broken); }), HasSubstr("'schema'"));
  EXPECT_NO_THROW(read_policy(path));
}

using Events = Folder;

TEST(Crc32c, KnownAnswers) {
  EXPECT_EQ(crc32c("123456789"), 0xE3069283u);            // the check value of the CRC catalogue
  EXPECT_EQ(crc32c(std::string(32, '\0')), 0x8A9136AAu);  // RFC 3720, B.4
  EXPECT_EQ(crc32c(std::string(32, '\xff')), 0x62A8AB43u);
}

TEST_F(Events, RecordsAreFramedAsTfRecords) {
  {
    EventFile events(folder_.path());
    events.write(300, {{"loss", 0.5}});
  }
  const std::string path = std::filesystem::directory_iterator(folder_.path())->path();
  const std::string bytes = read_file(path);
  size_t offset = 0;
  std::vector<std::string> records;
  while (offset < bytes.size()) {
    uint64_t length = 0;
    uint32_t length_crc = 0, data_crc = 0;
    ASSERT_LE(offset + 16, bytes.size());
    std::memcpy(&length, bytes.data() + offset, 8);
    std::memcpy(&length_crc, bytes.data() + offset + 8, 4);
    records.push_back(bytes.substr(offset + 12, length));
    std::memcpy(&data_crc, bytes.data() + offset + 12 + length, 4);
    auto masked = [](uint32_t crc) { return ((crc >> 15) | (crc << 17)) + 0xA282EAD8u; };
    EXPECT_EQ(length_crc, masked(crc32c(bytes.substr(offset, 8))));
    EXPECT_EQ(data_crc, masked(crc32c(records.back())));
    offset += 16 + length;
  }
  ASSERT_EQ(records.size(), 2u);
  EXPECT_THAT(records[0], HasSubstr("brain.Event:2"));
  // After the time (tag 0x09 and 8 bytes): step 300, then summary { value { tag: "loss" simple_value: 0.5 } }.
  const std::string expected("\x10\xac\x02\x2a\x0d\x0a\x0b\x0a\x04loss\x15\x00\x00\x00\x3f", 18);
  EXPECT_EQ(records[1].substr(9), expected);
}

TEST_F(Events, HoldTheConfigurationAsHyperparametersAndText) {
  EventFile events(folder_.path());
  events.write_configuration(
      {{"train.gamma", "0.5"}, {"simulator.walls", "true"}, {"run.device", "\"cpu\""}, {"a", "[1]"}},
      "[train]\ngamma = 0.5\n");
  const std::string bytes = read_file(std::filesystem::directory_iterator(folder_.path())->path());
  EXPECT_THAT(bytes, HasSubstr("_hparams_/session_start_info"));
  // Entries of a map: field 1 the name, field 2 a google.protobuf.Value of a double, a bool, a string.
  EXPECT_THAT(bytes, HasSubstr(std::string("\x0a\x18\x0a\x0btrain.gamma\x12\x09\x11\0\0\0\0\0\0\xe0\x3f", 26)));
  EXPECT_THAT(bytes, HasSubstr("\x0a\x15\x0a\x0fsimulator.walls\x12\x02\x20\x01"));
  EXPECT_THAT(bytes, HasSubstr("\x0a\x13\x0a\x0arun.device\x12\x05\x1a\x03"
                               "cpu"));
  EXPECT_THAT(bytes, Not(HasSubstr("[1]")));  // a list
  EXPECT_THAT(bytes, HasSubstr("    [train]\n    gamma = 0.5\n"));
}

}  // namespace
}  // namespace pictura
