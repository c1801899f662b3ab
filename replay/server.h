// Web server for pages that watch a running world. The URL is unguessable. The server never waits for a page: a slow
// page misses messages, then receives the complete state.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/replay/live.h"

namespace pictura {

struct LiveServerOptions {
  int port = 0;  // 0: any free port
  // If set, listens on all addresses, and accepts requests to this name and the loopback's names.
  std::string host_name;
  int num_agents = 0;  // agents in requests must be below it
};

/// Maximum number of simultaneous pages.
constexpr int kMaxLivePages = 8;
/// Maximum waiting messages and bytes of a page.
constexpr size_t kMaxWaitingMessages = 256, kMaxWaitingBytes = size_t{32} << 20;

class LiveServer {
 public:
  /// Listens in separate threads. Throws UsageError if the host name has characters other than letters, digits, dots
  /// and hyphens, and Error if the port is in use.
  explicit LiveServer(const LiveServerOptions& options);
  ~LiveServer();

  /// Returns the page's URL, which contains a secret.
  const std::string& address() const;

  /// Sends an event to all pages that have the initial events and are not too slow. Calls `message` only if such a page
  /// exists. Never waits.
  void send(std::string_view event, const std::function<LiveJson()>& message);
  /// Whether a page needs send_initial_events(): a new page, or a slow page that has read all its waiting messages.
  bool has_ungreeted_pages() const;
  struct Message {
    std::string_view event;
    LiveJson data;
  };
  /// Sends these events to the pages that need them. send() then includes these pages.
  void send_initial_events(const std::vector<Message>& messages);

  /// Returns the requests since the last call, in order of arrival.
  std::vector<LiveRequest> take_requests();
  /// Waits until there is a request, has_ungreeted_pages() is true, or `end`.
  void wait_until(std::chrono::steady_clock::time_point end);
  int num_pages() const;
  /// Waits at most `patience` until all messages are written.
  void flush(std::chrono::milliseconds patience);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
