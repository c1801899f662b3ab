// Renderers by name. This file alone knows every renderer backend.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Makes a renderer by name: "cpu", "cuda", "gl" ("gl:egl" if EGL gives a context, else "gl:osmesa"), "gl:egl",
/// "gl:osmesa", "null" (draws black images, to run everything else without a renderer), or "auto". `auto` is `cuda` if
/// config.device is a CUDA device and such a device is found, else `cpu`. `choice_out`, if given, gets the choice and
/// its reason and, for `cuda`, the origin of its kernels. If config.device is the host, `cuda` copies scenes to the
/// device and images back. Throws UsageError listing the known names, and Error when the backend cannot run here.
std::unique_ptr<Renderer> make_renderer(const std::string& name, const RendererConfig& config,
                                        std::string* choice_out = nullptr);

/// Returns the names of this build's renderers, in the order in which error messages list them.
std::vector<std::string> renderer_names();

}  // namespace pictura
