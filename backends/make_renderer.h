// Creates renderers from their names.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Makes a renderer: "cpu", "cuda", "gl:egl", "gl:osmesa", "gl" ("gl:egl" if EGL gives a context, else "gl:osmesa"),
/// "null" (black images), or "auto" ("cuda" if config.device is a CUDA device and a usable CUDA device is found, else
/// "cpu"). choice_out receives the reason for the choice and, for "cuda", the origin of the kernels. If config.device
/// is the host, "cuda" copies scenes and images. Throws UsageError listing the known names if the name is unknown, and
/// Error if the backend cannot run on this machine.
std::unique_ptr<Renderer> make_renderer(const std::string& name, const RendererConfig& config,
                                        std::string* choice_out = nullptr);

std::vector<std::string> renderer_names();

}  // namespace pictura
