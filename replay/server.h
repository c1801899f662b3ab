// Web server for pages that watch a running world. It serves one page under an unguessable address, sends it
// server-sent events, and receives requests. The server never waits for a page: a page that reads too slowly misses
// messages, and is sent the complete state once it reads again.
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
  int port = 0;           // 0: a free one
  std::string host_name;  // if set: listens on all addresses, and answers to this name besides the loopback's
  int num_agents = 0;     // bound of the agents in requests
};

/// Maximum number of pages that watch a world at a time.
constexpr int kMaxLivePages = 8;
/// Maximum number of messages and bytes waiting for a page.
constexpr size_t kMaxWaitingMessages = 256, kMaxWaitingBytes = size_t{32} << 20;

class LiveServer {
 public:
  /// Starts listening, in threads of its own. Throws UsageError for a host name that no browser sends, and Error if the
  /// port is in use.
  explicit LiveServer(const LiveServerOptions& options);
  /// Closes all connections.
  ~LiveServer();

  /// Address of the page, including its secret.
  const std::string& address() const;

  /// Sends an event to all pages that have received the initial events and keep up. Calls `message` for its data only
  /// if a page is listening. Never waits.
  void send(std::string_view event, const std::function<LiveJson()>& message);
  /// Whether send_initial_events() is due for a page: a new one, or one that fell behind and has since read everything
  /// that waited for it.
  bool has_ungreeted_pages() const;
  /// Event for send_initial_events().
  struct Message {
    std::string_view event;
    LiveJson data;
  };
  /// Sends these events to the pages for which has_ungreeted_pages() is true. From now on they receive the events of
  /// send().
  void send_initial_events(const std::vector<Message>& messages);

  /// Returns the requests since the last call, in order.
  std::vector<LiveRequest> take_requests();
  /// Waits until a request or a page arrives, or until `end`.
  void wait_until(std::chrono::steady_clock::time_point end);
  /// Number of listening pages.
  int num_pages() const;
  /// Waits, for at most `patience`, until every page has read all that was sent to it.
  void flush(std::chrono::milliseconds patience);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
