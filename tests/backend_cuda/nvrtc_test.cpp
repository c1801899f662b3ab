// Shared headers (rules, scene, raster) compiled without a standard library, on machines without a GPU.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nvrtc.h>

namespace pictura {
namespace {

// Returns the compiler's messages; empty where the source compiles to code for the architecture.
std::string compile(const std::string& source, const std::string& architecture) {
  nvrtcProgram program = nullptr;
  if (nvrtcCreateProgram(&program, source.c_str(), "test.cu", 0, nullptr, nullptr) != NVRTC_SUCCESS)
    return "no program";
  const std::string arch = "--gpu-architecture=" + architecture;
  const char* options[] = {arch.c_str(), "--std=c++20", "--fmad=false", "-I" PICTURA_TEST_INCLUDE_DIR};
  const nvrtcResult result = nvrtcCompileProgram(program, 4, options);
  std::size_t size = 0;
  nvrtcGetProgramLogSize(program, &size);
  std::string log(size, '\0');
  nvrtcGetProgramLog(program, log.data());
  std::size_t code_bytes = 0;
  nvrtcGetCUBINSize(program, &code_bytes);
  nvrtcDestroyProgram(&program);
  if (result != NVRTC_SUCCESS) return log;
  return code_bytes > 0 ? "" : "no code";
}

// Returns the names of headers that both devices read, as they are included.
std::vector<std::string> shared_headers() {
  std::vector<std::string> headers;
  for (const char* name : {"color", "device", "grid_view", "math", "rng", "scene_types", "span"}) {
    headers.push_back(std::string("pictura/common/") + name + ".h");
  }
  const std::filesystem::path root = PICTURA_TEST_INCLUDE_DIR "/pictura";
  // These headers are for hosts: they use errors and vectors.
  const std::vector<std::string> host_headers{"pictura/common/raster/check.h",
                                              "pictura/common/raster/host_geometries.h"};
  for (const char* folder : {"common/portable", "common/raster", "simulator/rules"}) {
    if (!std::filesystem::is_directory(root / folder)) continue;
    for (const auto& file : std::filesystem::directory_iterator(root / folder)) {
      const std::string name = fmt::format("pictura/{}/{}", folder, file.path().filename().string());
      if (name.ends_with(".h") && std::find(host_headers.begin(), host_headers.end(), name) == host_headers.end()) {
        headers.push_back(name);
      }
    }
  }
  std::sort(headers.begin(), headers.end());
  return headers;
}

class NvrtcHeader : public testing::TestWithParam<std::string> {};

TEST_P(NvrtcHeader, CompilesTheHeaderAlone) {
  EXPECT_EQ(compile("#include \"" + GetParam() + "\"\n__global__ void kernel() {}\n", "sm_90"), "");
}

INSTANTIATE_TEST_SUITE_P(All, NvrtcHeader, testing::ValuesIn(shared_headers()), [](const auto& header) {
  std::string name = header.param.substr(std::string("pictura/").size());
  std::replace_if(name.begin(), name.end(), [](char c) { return c == '.' || c == '/'; }, '_');
  return name;
});

TEST(Nvrtc, RefusesHeadersOfTheStandardLibrary) {
  EXPECT_NE(compile("#include <vector>\n__global__ void kernel() {}\n", "sm_90"), "");
}

}  // namespace
}  // namespace pictura
