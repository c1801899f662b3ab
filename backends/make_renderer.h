// Makes renderers by name. Only make_renderer.cpp refers to all renderer backends.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Makes a renderer by name: "cpu", "cuda", "gl" ("gl:egl" if EGL gives a context, else "gl:osmesa"), "gl:egl",
/// "gl:osmesa", "null" (draws black images, so that everything else can run without a renderer), or "auto". "auto" is
/// "cuda" if config.device is a CUDA device and a usable CUDA device is found, else "cpu". If choice_out is not null,
/// it receives a description of the choice: its reason and, for "cuda", the origin of the kernels. If config.device is
/// the host, "cuda" copies scenes to the device and images back. Throws UsageError listing the known names if the name
/// is unknown. Throws Error if the backend cannot run on this machine.
std::unique_ptr<Renderer> make_renderer(const std::string& name, const RendererConfig& config,
                                        std::string* choice_out = nullptr);

/// Returns the names of this build's renderers, in the order in which error messages list them.
std::vector<std::string> renderer_names();

}  // namespace pictura
