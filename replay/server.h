// Web server for pages that watch a running world. It serves a page at an unguessable URL, sends server-sent events to
// the page, and receives requests from it. The server never waits for a page. A page that reads too slowly misses
// messages, and receives the complete state when it has caught up.
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
  // If set, the server listens on all addresses, and accepts requests to this name and to the loopback's names.
  std::string host_name;
  int num_agents = 0;  // agents in requests must be below this number
};

/// Maximum number of pages that watch a world at the same time.
constexpr int kMaxLivePages = 8;
/// Maximum numbers of messages and bytes that wait for a page.
constexpr size_t kMaxWaitingMessages = 256, kMaxWaitingBytes = size_t{32} << 20;

class LiveServer {
 public:
  /// Starts listening, in separate threads. Throws UsageError if the host name has characters other than letters,
  /// digits, dots and hyphens, and Error if the port is in use.
  explicit LiveServer(const LiveServerOptions& options);
  /// Closes all connections.
  ~LiveServer();

  /// Returns the URL of the page, which contains a secret.
  const std::string& address() const;

  /// Sends an event to all pages that have received the initial events and are not too slow. Calls `message`, which
  /// returns the event's data, only if there is such a page. Never waits.
  void send(std::string_view event, const std::function<LiveJson()>& message);
  /// Whether any page needs send_initial_events(). A new page needs it, and so does a page that was too slow and has
  /// since read all messages that waited for it.
  bool has_ungreeted_pages() const;
  /// An event for send_initial_events().
  struct Message {
    std::string_view event;
    LiveJson data;
  };
  /// Sends these events to the pages that need them; see has_ungreeted_pages(). From then on, these pages receive the
  /// events of send().
  void send_initial_events(const std::vector<Message>& messages);

  /// Returns the requests since the last call, in the order of their arrival.
  std::vector<LiveRequest> take_requests();
  /// Waits until there is a request or has_ungreeted_pages() is true, but at most until `end`.
  void wait_until(std::chrono::steady_clock::time_point end);
  /// Returns the number of listening pages.
  int num_pages() const;
  /// Waits until all messages to all pages have been written, but at most for `patience`.
  void flush(std::chrono::milliseconds patience);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
