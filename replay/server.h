// A web server for pages that watch a world while it runs. It serves one page under an address that nobody can guess,
// tells it of what happens by server-sent events, and takes what people ask. Nothing here waits for a page: one that
// reads too slowly misses messages, and is told all anew once it reads again.
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
  int num_agents = 0;     // that requests may name
};

/// Pages that are told of a world at a time.
constexpr int kMaxLivePages = 8;
/// Messages and bytes that may wait for a page.
constexpr size_t kMaxWaitingMessages = 256, kMaxWaitingBytes = size_t{32} << 20;

class LiveServer {
 public:
  /// Listens from now on, in threads of its own. Throws UsageError for a host name that no browser sends, and Error
  /// where the port is taken.
  explicit LiveServer(const LiveServerOptions& options);
  /// Ends all connections.
  ~LiveServer();

  /// The page's, with its secret.
  const std::string& address() const;

  /// Sends an event with what `message` gives, which is asked for only where a page listens: to all pages that have
  /// been greeted and keep up. Never waits.
  void send(std::string_view event, const std::function<LiveJson()>& message);
  /// Whether there are pages that have not been greeted, or that fell behind and have read all that waited for them.
  bool has_newcomers() const;
  /// Sends them these events; from now on they get what all get.
  struct Message {
    std::string_view event;
    LiveJson data;
  };
  void greet(const std::vector<Message>& messages);

  /// What was asked since the last time, in its order.
  std::vector<LiveRequest> take_requests();
  /// Waits until something was asked, a page came, or the time is over.
  void wait_until(std::chrono::steady_clock::time_point end);
  /// How many pages listen.
  int num_pages() const;
  /// Waits until every page has read what was sent to it, or the time is over.
  void flush(std::chrono::milliseconds patience);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
