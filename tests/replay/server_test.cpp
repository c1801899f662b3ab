// The server of live pages, its pages and a simulation at work at once, each in threads of its own.
#include "pictura/replay/server.h"

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>

#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

constexpr int kFrames = 60, kRequests = 20, kServedAgents = 4;

/// What a page was told: frames that did not follow one another are counted.
struct Told {
  int begins = 0, frames = 0, out_of_order = 0;
};

/// Listens at `origin` + `path` until it was told kFrames.
Told listen(const std::string& origin, const std::string& path) {
  Told told;
  std::string text;
  int next = -1;
  httplib::Client client(origin);
  client.Get(path + "events", [&](const char* bytes, size_t length) {
    text.append(bytes, length);
    for (size_t end; (end = text.find("\n\n")) != std::string::npos; text.erase(0, end + 2)) {
      const std::string event = text.substr(0, end);
      const size_t data = event.find("\ndata: ");
      if (data == std::string::npos) continue;  // a heartbeat
      const int step = LiveJson::parse(event.substr(data + 7))["step"];
      if (event.starts_with("event: begin")) {
        ++told.begins;
      } else {
        ++told.frames;
        told.out_of_order += step != next;
      }
      next = step + 1;
    }
    return told.frames < kFrames;
  });
  return told;
}

TEST(LiveServer, TellsItsPagesAllInOrderWhileOthersComeAskAndGo) {
  if (!can_serve()) GTEST_SKIP() << "this build cannot serve";
  auto server = std::make_unique<LiveServer>(LiveServerOptions{.num_agents = kServedAgents});
  const size_t root = server->address().find('/', std::string("http://").size());
  const std::string origin = server->address().substr(0, root), path = server->address().substr(root);

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
  for (Told& page : told) start([&page, &origin, &path] { page = listen(origin, path); });
  start([&] {
    httplib::Client client(origin);
    for (int i = 0; i < kRequests; ++i) {
      const std::string body = LiveJson{{"watch", i % kServedAgents}}.dump();
      const auto answer = client.Post(path + "control", body, "application/json");
      statuses[static_cast<size_t>(i)] = answer ? answer->status : 0;
    }
  });

  std::vector<int> watched;
  const auto take = [&] {
    for (const LiveRequest& request : server->take_requests()) watched.push_back(request.watched.value_or(-1));
  };
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  for (int step = 1; at_work > 0 && std::chrono::steady_clock::now() < end; ++step) {
    server->send("frame", [&] { return LiveJson{{"step", step}}; });
    if (server->has_newcomers()) server->greet({{"begin", {{"step", step}}}});
    take();
    server->wait_until(std::chrono::steady_clock::now() + std::chrono::milliseconds(2));
  }
  EXPECT_EQ(at_work, 0) << "pages or requests still wait";
  take();
  server.reset();  // which ends whatever waits
  for (std::thread& thread : threads) thread.join();

  for (const Told& page : told) {
    EXPECT_GE(page.begins, 1);
    EXPECT_GE(page.frames, kFrames);
    EXPECT_EQ(page.out_of_order, 0);
  }
  EXPECT_THAT(statuses, ::testing::Each(204));
  ASSERT_EQ(watched.size(), static_cast<size_t>(kRequests));
  for (int i = 0; i < kRequests; ++i) EXPECT_EQ(watched[static_cast<size_t>(i)], i % kServedAgents);
}

TEST(LiveServer, HasItsPortForItselfAndRefusesNamesThatNoBrowserSends) {
  if (!can_serve()) GTEST_SKIP() << "this build cannot serve";
  const LiveServer first(LiveServerOptions{.num_agents = 1});
  const std::string address = first.address();
  const int port = std::stoi(address.substr(address.rfind(':') + 1));
  EXPECT_THAT(test::message_of([&] { LiveServer(LiveServerOptions{.port = port, .num_agents = 1}); }),
              testing::HasSubstr("is the port taken?"));
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
