// Headers of rules, scene and raster compile without a standard library, on machines that have no GPU.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nvrtc.h>

namespace pictura {
namespace {

// Compiler messages, or empty where the source compiles to code for the architecture.
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

// Names of the headers that both devices read, as they are included.
std::vector<std::string> shared_headers() {
  std::vector<std::string> headers;
  for (const char* name : {"color", "grid_view", "hd", "math", "rng", "scene_types", "span", "stream"}) {
    headers.push_back(std::string("pictura/common/") + name + ".h");
  }
  const std::filesystem::path root = PICTURA_TEST_INCLUDE_DIR "/pictura";
  for (const auto& file : std::filesystem::directory_iterator(root / "common")) {
    const std::string name = file.path().filename().string();
    // common/raster/check.h is for hosts: it speaks of errors and vectors.
    if (name.starts_with("raster_") && name.ends_with(".h") && name != "common/raster/check.h") {
      headers.push_back("pictura/common/" + name);
    }
  }
  if (std::filesystem::is_directory(root / "simulator" / "rules")) {
    for (const auto& file : std::filesystem::directory_iterator(root / "simulator" / "rules")) {
      const std::string name = file.path().filename().string();
      if (name.ends_with(".h")) headers.push_back("pictura/simulator/rules/" + name);
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
  std::string name = header.param.substr(header.param.rfind('/') + 1);
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

TEST(Nvrtc, AHeaderOfTheStandardLibraryIsAFault) {
  EXPECT_NE(compile("#include <vector>\n__global__ void kernel() {}\n", "sm_90"), "");
}

}  // namespace
}  // namespace pictura
