// Server of live pages. The server, its clients and a simulation run concurrently, each in its own threads.
#include "pictura/replay/server.h"

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

constexpr int kFrames = 60, kRequests = 20, kServedAgents = 4;

/// Messages received by a page; frames that do not follow one another are counted.
struct Told {
  int begins = 0, frames = 0, out_of_order = 0;
};

constexpr size_t kHost = std::string_view("http://").size();  // offset in addresses

std::string request_to(const std::string& address, const char* method, const char* name, const std::string& body = "") {
  const size_t path = address.find('/', kHost);
  return fmt::format("{} {}{} HTTP/1.1\r\nHost: {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{}",
                     method, address.substr(path), name, address.substr(kHost, path - kHost), body.size(), body);
}

/// A connection to the server at `address` that has sent `text`.
class Connection {
 public:
  Connection(const std::string& address, const std::string& text) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(address.find(':', kHost) + 1))));
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) return;
    send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
  }
  ~Connection() { close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Appends the next bytes. Returns false at the end.
  bool read(std::string* text) {
    std::array<char, 4096> bytes;
    const ssize_t got = recv(socket_, bytes.data(), bytes.size(), 0);
    if (got > 0) text->append(bytes.data(), static_cast<size_t>(got));
    return got > 0;
  }

 private:
  int socket_ = socket(AF_INET, SOCK_STREAM, 0);
};

/// Listens until kFrames frames have arrived.
Told listen(const std::string& address) {
  Told told;
  std::string text;
  int next = -1;
  Connection connection(address, request_to(address, "GET", "events"));
  while (told.frames < kFrames && connection.read(&text)) {
    for (size_t end; (end = text.find("\n\n")) != std::string::npos; text.erase(0, end + 2)) {
      const std::string event = text.substr(0, end);
      const size_t begin = event.find("event: "), data = event.find("\ndata: ");
      if (data == std::string::npos) continue;  // a heartbeat
      const int step = LiveJson::parse(event.substr(data + 7))["step"];
      if (event.substr(begin).starts_with("event: begin")) {
        ++told.begins;
      } else {
        ++told.frames;
        told.out_of_order += step != next;
      }
      next = step + 1;
    }
  }
  return told;
}

TEST(LiveServer, SendsAllEventsInOrderAmidOtherConnections) {
  auto server = std::make_unique<LiveServer>(LiveServerOptions{.num_agents = kServedAgents});
  const std::string address = server->address();

  std::array<Told, 3> told;
  std::array<int, kRequests> statuses{};
  std::atomic<int> at_work = 0;
  std::vector<std::thread> threads;
  const auto start = [&](auto&& work) {
    ++at_work;
    threads.emplace_back([work, &at_work] {
      work();
      --at_work;
    });
  };
  for (Told& page : told) start([&page, &address] { page = listen(address); });
  start([&] {
    for (int i = 0; i < kRequests; ++i) {
      const std::string body = LiveJson{{"watch", i % kServedAgents}}.dump();
      std::string answer;
      Connection(address, request_to(address, "POST", "control", body)).read(&answer);
      statuses[i] = answer.starts_with("HTTP/1.1 204 ") ? 204 : 0;
    }
  });

  std::vector<int> watched;
  const auto take = [&] {
    for (const LiveRequest& request : server->take_requests()) watched.push_back(request.watched.value_or(-1));
  };
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  for (int step = 1; at_work > 0 && std::chrono::steady_clock::now() < end; ++step) {
    server->send("frame", [&] { return LiveJson{{"step", step}}; });
    if (server->has_ungreeted_pages()) server->send_initial_events({{"begin", {{"step", step}}}});
    take();
    server->wait_until(std::chrono::steady_clock::now() + std::chrono::milliseconds(2));
  }
  EXPECT_EQ(at_work, 0) << "pages or requests still wait";
  take();
  server.reset();  // this ends all waiting calls
  for (std::thread& thread : threads) thread.join();

  for (const Told& page : told) {
    EXPECT_GE(page.begins, 1);
    EXPECT_GE(page.frames, kFrames);
    EXPECT_EQ(page.out_of_order, 0);
  }
  EXPECT_THAT(statuses, ::testing::Each(204));
  ASSERT_EQ(watched.size(), static_cast<size_t>(kRequests));
  for (int i = 0; i < kRequests; ++i) EXPECT_EQ(watched[i], i % kServedAgents);
}

TEST(LiveServer, EndsAtOnceForAnyConnectionState) {
  auto server = std::make_unique<LiveServer>(LiveServerOptions{.num_agents = 1});
  std::vector<std::unique_ptr<Connection>> connections;
  const auto connect = [&](const std::string& text) {
    connections.push_back(std::make_unique<Connection>(server->address(), text));
  };
  connect(request_to(server->address(), "GET", "events"));  // this connection never reads
  while (server->num_pages() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  server->send_initial_events({});
  server->send("frame", [] { return LiveJson(std::string(kMaxWaitingBytes / 2, 'x')); });
  for (int i = 0; i < 30; ++i) connect("GET / HTT");  // more connections than threads
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const auto begin = std::chrono::steady_clock::now();
  server.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
}

TEST(LiveServer, RefusesAPortInUseAndInvalidHostNames) {
  const LiveServer first(LiveServerOptions{.num_agents = 1});
  const std::string address = first.address();
  const int port = std::stoi(address.substr(address.rfind(':') + 1));
  EXPECT_THAT(test::message_of([&] { LiveServer(LiveServerOptions{.port = port, .num_agents = 1}); }),
              testing::HasSubstr("is the port in use?"));
  const LiveServer named(LiveServerOptions{.host_name = "LocalHost", .num_agents = 1});
  EXPECT_THAT(named.address(), testing::StartsWith("http://localhost:"));
  for (const char* name : {"a b", "x/y", "a:1", "\"><script>"}) {
    EXPECT_THAT(
        test::message_of<UsageError>([&] { LiveServer(LiveServerOptions{.host_name = name, .num_agents = 1}); }),
        testing::HasSubstr("expected letters, digits, dots and hyphens"))
        << name;
  }
}

}  // namespace
}  // namespace pictura
