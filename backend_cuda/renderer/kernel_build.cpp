#include "pictura/backend_cuda/renderer/kernel_build.h"

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <vector>

#include <cuda_runtime_api.h>
#include <nvrtc.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/shared_library.h"

namespace pictura::cuda {

namespace {

constexpr std::size_t kMaxCode_bytes = std::size_t{64} << 20;

// Opens NVRTC: the library at PICTURA_NVRTC, else the library of the toolkit's major version on the loader's path, else
// the library in the folder that this program was built with.
SharedLibrary open_nvrtc() {
  constexpr const char* kSource = "CUDA toolkit, or Python package nvidia-cuda-nvrtc";
  const char* chosen = std::getenv("PICTURA_NVRTC");
  if (chosen && *chosen) {
    PICTURA_CHECK(std::string(chosen) != "off", "renderer cuda: PICTURA_NVRTC=off");
    return {"cuda", chosen, kSource};
  }
  const std::string file = fmt::format("libnvrtc.so.{}", CUDART_VERSION / 1000);
  const std::string fallback = fmt::format("{}/{}", PICTURA_NVRTC_FOLDER, file);
  std::error_code error;
  try {
    return {"cuda", file, kSource};
  } catch (const Error&) {
    if (!std::filesystem::exists(fallback, error)) throw;
    return {"cuda", fallback, kSource};
  }
}

// The functions of NVRTC that this file uses.
struct Nvrtc {
  SharedLibrary library = open_nvrtc();
#define PICTURA_NVRTC_FUNCTION(name) decltype(&::name) name = function<decltype(&::name)>(#name)
  PICTURA_NVRTC_FUNCTION(nvrtcVersion);
  PICTURA_NVRTC_FUNCTION(nvrtcGetNumSupportedArchs);
  PICTURA_NVRTC_FUNCTION(nvrtcGetSupportedArchs);
  PICTURA_NVRTC_FUNCTION(nvrtcCreateProgram);
  PICTURA_NVRTC_FUNCTION(nvrtcDestroyProgram);
  PICTURA_NVRTC_FUNCTION(nvrtcCompileProgram);
  PICTURA_NVRTC_FUNCTION(nvrtcGetProgramLogSize);
  PICTURA_NVRTC_FUNCTION(nvrtcGetProgramLog);
  PICTURA_NVRTC_FUNCTION(nvrtcGetCUBINSize);
  PICTURA_NVRTC_FUNCTION(nvrtcGetCUBIN);
  PICTURA_NVRTC_FUNCTION(nvrtcGetPTXSize);
  PICTURA_NVRTC_FUNCTION(nvrtcGetPTX);
  PICTURA_NVRTC_FUNCTION(nvrtcGetErrorString);
#undef PICTURA_NVRTC_FUNCTION

  void check(nvrtcResult result, const char* what) const {
    PICTURA_CHECK(result == NVRTC_SUCCESS, "nvrtc: {}: {}", what, nvrtcGetErrorString(result));
  }

 private:
  template <typename Function>
  Function function(const char* name) const {
    return reinterpret_cast<Function>(library.function(name));
  }
};

// Inputs of a compilation, except for the sources.
struct Compilation {
  std::string architecture;
  bool is_cubin = true;
  std::vector<std::string> options;
  uint64_t key = 0;  // hash of sources, options and the compiler's version
};

Compilation compilation_for(const Nvrtc& nvrtc, const KernelProgram& program, const KernelTarget& target) {
  int count = 0;
  nvrtc.check(nvrtc.nvrtcGetNumSupportedArchs(&count), "supported architectures");
  std::vector<int> known(static_cast<std::size_t>(count));
  nvrtc.check(nvrtc.nvrtcGetSupportedArchs(known.data()), "supported architectures");
  // Finds the newest architecture that the device can run. If it is older than the device, the driver compiles PTX.
  int nearest = 0;
  for (const int each : known) {
    if (each <= target.compute_capability && each > nearest) nearest = each;
  }
  PICTURA_CHECK(nearest > 0, "nvrtc: compute capability {}: expected {} or more", target.compute_capability,
                known.empty() ? 0 : known.front());
  Compilation compilation;
  compilation.is_cubin = nearest == target.compute_capability;
  compilation.architecture = fmt::format("{}_{}", compilation.is_cubin ? "sm" : "compute", nearest);
  compilation.options = {"--gpu-architecture=" + compilation.architecture,
                         "--std=c++20",
                         "--fmad=false",     // no fused multiply-add, so that results are bit-identical to the CPU's
                         "-default-device",  // lambdas in kernels are device functions, as with nvcc
                         fmt::format("-DPICTURA_RIG_CAMERAS={}", target.num_cameras),
                         fmt::format("-DPICTURA_RIG_WIDTH_PX={}", target.width_px),
                         fmt::format("-DPICTURA_RIG_HEIGHT_PX={}", target.height_px),
                         fmt::format("-DPICTURA_RANDOMIZES_CAMERAS={}", target.randomizes_cameras ? 1 : 0)};
  int major = 0, minor = 0;
  nvrtc.check(nvrtc.nvrtcVersion(&major, &minor), "version");
  std::string all = fmt::format("{} {} {}\n{}", major, minor, fmt::join(compilation.options, " "), program.text);
  for (const KernelSource& header : program.headers) all += fmt::format("{}\n{}\n", header.name, header.text);
  compilation.key = hash_of(all);
  return compilation;
}

std::string compile(const Nvrtc& nvrtc, const KernelProgram& source, const Compilation& compilation) {
  std::vector<const char*> texts, names, options;
  for (const KernelSource& header : source.headers) {
    texts.push_back(header.text);
    names.push_back(header.name);
  }
  for (const std::string& option : compilation.options) options.push_back(option.c_str());
  nvrtcProgram program = nullptr;
  nvrtc.check(nvrtc.nvrtcCreateProgram(&program, source.text, "pictura_kernels.cu", static_cast<int>(texts.size()),
                                       texts.data(), names.data()),
              "program");
  const auto destroy = [&](nvrtcProgram* owned) { nvrtc.nvrtcDestroyProgram(owned); };
  const std::unique_ptr<nvrtcProgram, decltype(destroy)> owner(&program, destroy);
  const nvrtcResult result = nvrtc.nvrtcCompileProgram(program, static_cast<int>(options.size()), options.data());
  if (result != NVRTC_SUCCESS) {
    std::size_t log_bytes = 0;
    nvrtc.check(nvrtc.nvrtcGetProgramLogSize(program, &log_bytes), "messages");
    std::string log(log_bytes, '\0');
    nvrtc.check(nvrtc.nvrtcGetProgramLog(program, log.data()), "messages");
    fail("nvrtc: {}: {}:\n{}", compilation.architecture, nvrtc.nvrtcGetErrorString(result), log.c_str());
  }
  const auto get_size = compilation.is_cubin ? nvrtc.nvrtcGetCUBINSize : nvrtc.nvrtcGetPTXSize;
  const auto get_code = compilation.is_cubin ? nvrtc.nvrtcGetCUBIN : nvrtc.nvrtcGetPTX;
  std::size_t bytes = 0;
  nvrtc.check(get_size(program, &bytes), "size of the code");
  std::string code(bytes, '\0');
  nvrtc.check(get_code(program, code.data()), "code");
  return code;
}

std::string cache_path_of(const Compilation& compilation) {
  const std::string folder = cache_folder("kernels");
  if (folder.empty()) return "";
  return fmt::format("{}/{}-{:016x}.kernels", folder, compilation.architecture, compilation.key);
}

// Returns the first line of a cached file: the key of its inputs, and the size and hash of its code.
std::string header_of(uint64_t key, std::string_view code) {
  return fmt::format("pictura kernels 1 {:016x} {} {:016x}\n", key, code.size(), hash_of(code));
}

// Returns the code in a cached file, or an empty text if the file is missing, damaged or foreign.
std::string kept_code(const std::string& path, uint64_t key) {
  std::error_code error;
  if (path.empty() || !std::filesystem::exists(path, error)) return "";
  std::string bytes;
  try {
    bytes = read_file(path, kMaxCode_bytes);
  } catch (const Error&) {
    return "";
  }
  const std::size_t header_end = bytes.find('\n');
  if (header_end == std::string::npos) return "";
  const std::string code = bytes.substr(header_end + 1);
  return bytes == header_of(key, code) + code ? code : "";
}

}  // namespace

std::string nvrtc_unavailable() {
  try {
    Nvrtc();
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

KernelCode build_kernels(const KernelProgram& program, const KernelTarget& target) {
  const Nvrtc nvrtc;
  const Compilation compilation = compilation_for(nvrtc, program, target);
  const std::string path = cache_path_of(compilation);
  KernelCode code{kept_code(path, compilation.key), compilation.architecture, true};
  if (!code.bytes.empty()) return code;
  code.cached = false;
  code.bytes = compile(nvrtc, program, compilation);
  if (!path.empty()) write_to_cache(path, header_of(compilation.key, code.bytes) + code.bytes);
  return code;
}

std::string kernel_cache_path(const KernelProgram& program, const KernelTarget& target) {
  return cache_path_of(compilation_for(Nvrtc(), program, target));
}

}  // namespace pictura::cuda
