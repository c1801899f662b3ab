#include "pictura/driving/serve.h"

#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/messages.h"

namespace pictura {

std::unique_ptr<LiveView> serve(const ServeOptions& options, Simulator& simulator, const RecordedDriver& driver,
                                const RecordingOptions& recording) {
  const LiveViewOptions view{.port = options.port,
                             .host_name = options.host_name,
                             .watched = recording.followed.value_or(0),
                             .cameras = cameras_of(driver),
                             .sends_images = recording.cameras};
  auto serving = std::make_unique<LiveView>(simulator, view, origin_of(driver), [&simulator, driver](int agent) {
    return decision_of_agent(simulator, driver, agent);
  });
  // The fragment of the URL selects the followed agent when the page opens.
  const std::string opens_with = recording.followed ? fmt::format("#agent={}", *recording.followed) : "";
  print_message("serving {}{} (^C ends it)\n", serving->address(), opens_with);
  return serving;
}

bool await_step(LiveView& view) {
  while (!interrupted()) {
    if (view.is_due()) return true;
  }
  return false;
}

}  // namespace pictura
