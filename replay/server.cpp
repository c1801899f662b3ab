#include "pictura/replay/server.h"

#ifdef PICTURA_HAS_HTTPLIB
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>

#include <httplib.h>
#include <sys/random.h>
#include <sys/socket.h>

#include "pictura/common/error.h"
#include "pictura/common/support/json_text.h"
#include "pictura/replay/page_sources.h"
#include "pictura/replay/template.h"
#endif

namespace pictura {

#ifdef PICTURA_HAS_HTTPLIB

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTokenBytes = 16;
constexpr size_t kMaxRequestBytes = 4096;
constexpr std::chrono::seconds kMaxWriteTime{20}, kMaxReadTime{5}, kKeepAlive{2};
constexpr std::chrono::seconds kHeartbeat{10};  // shows the server that a page has gone

std::string random_token() {
  std::array<unsigned char, kTokenBytes> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::generic_category(), "serve: no random numbers");
  }
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

// In a time that does not tell how much is equal.
bool is_equal(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  int difference = 0;
  for (size_t i = 0; i < a.size(); ++i) difference |= a[i] ^ b[i];
  return difference == 0;
}

// As browsers send it. Throws UsageError unless it is a name or an address that they could.
std::string host_name_of(std::string name) {
  for (char& c : name) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    const bool is_allowed = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-';
    if (!is_allowed) {
      fail_usage("serve: host name '{}': expected letters, digits, dots and hyphens, as a name or an IPv4 address",
                 name);
    }
  }
  return name;
}

using Text = std::shared_ptr<const std::string>;

Text event_text(std::string_view event, const LiveJson& data) {
  return std::make_shared<const std::string>(fmt::format("event: {}\ndata: {}\n\n", event, json_text(data)));
}

/// A page that listens.
struct Listener {
  std::deque<Text> waiting;
  size_t bytes = 0;
  bool is_greeted = false;
  bool is_writing = false;
};

}  // namespace

struct LiveServer::Parts {
  explicit Parts(const LiveServerOptions& its_options)
      : options(its_options), host_name(host_name_of(its_options.host_name)), token(random_token()) {
    server.new_task_queue = [] { return new httplib::ThreadPool(kMaxLivePages + 8); };
    server.set_payload_max_length(kMaxRequestBytes);
    server.set_read_timeout(kMaxReadTime);
    server.set_write_timeout(kMaxWriteTime);
    server.set_keep_alive_timeout(kKeepAlive.count());
    server.set_tcp_nodelay(true);
    // The library's own also lets several servers share a port.
    server.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"Content-Security-Policy",
          "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src "
          "'self'; worker-src blob:; img-src data: blob:; base-uri 'none'; form-action 'none'; "
          "frame-ancestors 'none'"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Referrer-Policy", "no-referrer"},
         {"X-Content-Type-Options", "nosniff"}});
    server.set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) { return admit(request, response); });
    const std::string root = "/" + token;
    server.Get(root + "/", [](const httplib::Request&, httplib::Response& response) {
      const std::string page = filled(page::replay_html(), {{"title", "live"}, {"elements", kLiveElement}});
      response.set_content(page, "text/html; charset=utf-8");
    });
    server.Get(root + "/events",
               [this](const httplib::Request&, httplib::Response& response) { give_events(response); });
    server.Post(root + "/control", [this](const httplib::Request& request, httplib::Response& response) {
      take_request(request, response);
    });
    const bool everywhere = !host_name.empty();
    const std::string listened = everywhere ? "0.0.0.0" : "127.0.0.1";
    port = options.port;
    if (port == 0) {
      port = server.bind_to_any_port(listened);
    } else if (!server.bind_to_port(listened, port)) {
      port = -1;
    }
    PICTURA_CHECK(port > 0, "serve: cannot listen on {}:{}: is the port taken?", listened, options.port);
    address = fmt::format("http://{}:{}/{}/", everywhere ? host_name : "127.0.0.1", port, token);
    for (const std::string& name : {std::string("127.0.0.1"), std::string("localhost"), host_name}) {
      if (name.empty()) continue;
      hosts.push_back(fmt::format("{}:{}", name, port));
      if (port == 80) hosts.push_back(name);  // as browsers say it
    }
    thread = std::thread([this] { server.listen_after_bind(); });
    // stop() does nothing before this.
    while (!server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  ~Parts() {
    {
      const std::lock_guard lock(mutex);
      is_closing = true;
    }
    changed.notify_all();
    server.stop();
    thread.join();
  }

  // Pages of other sites reach the loopback too: by names that they point at it, which Host shows, and by requests of
  // their own, which Origin shows.
  httplib::Server::HandlerResponse admit(const httplib::Request& request, httplib::Response& response) const {
    const auto refuse = [&response](int status, const char* why) {
      response.status = status;
      response.set_content(std::string(why) + "\n", "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    };
    const std::string host = request.get_header_value("Host");
    if (request.get_header_value_count("Host") != 1 || std::find(hosts.begin(), hosts.end(), host) == hosts.end()) {
      return refuse(403, "this host name is not served");
    }
    if (request.has_header("Origin") && request.get_header_value("Origin") != "http://" + host) {
      return refuse(403, "other origins are not served");
    }
    const std::string site = request.get_header_value("Sec-Fetch-Site");
    if (!site.empty() && site != "same-origin" && site != "none") return refuse(403, "other sites are not served");
    const std::string_view path = request.path;
    if (path.size() < token.size() + 2 || !is_equal(path.substr(1, token.size()), token)) {
      return refuse(404, "nothing here");
    }
    return httplib::Server::HandlerResponse::Unhandled;
  }

  void give_events(httplib::Response& response) {
    auto listener = std::make_shared<Listener>();
    {
      const std::lock_guard lock(mutex);
      if (listeners.size() >= kMaxLivePages) {
        response.status = 503;
        response.set_content(fmt::format("{} pages listen already\n", kMaxLivePages), "text/plain");
        return;
      }
      listeners.push_back(listener);
    }
    changed.notify_all();
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, listener](size_t /*offset*/, httplib::DataSink& sink) { return write_next(*listener, sink); },
        [this, listener](bool /*success*/) {
          {
            const std::lock_guard lock(mutex);
            listeners.erase(std::remove(listeners.begin(), listeners.end(), listener), listeners.end());
          }
          changed.notify_all();
        });
  }

  // Whether the connection goes on.
  bool write_next(Listener& listener, httplib::DataSink& sink) {
    Text text;
    {
      std::unique_lock lock(mutex);
      listener.is_writing = false;
      changed.notify_all();
      const bool has_news = changed.wait_for(lock, kHeartbeat, [&] { return is_closing || !listener.waiting.empty(); });
      if (is_closing) {
        sink.done();
        return true;
      }
      if (has_news) {
        text = listener.waiting.front();
        listener.waiting.pop_front();
        listener.bytes -= text->size();
        listener.is_writing = true;
      }
    }
    static const std::string heartbeat = ":\n\n";
    const std::string& bytes = text ? *text : heartbeat;
    return sink.write(bytes.data(), bytes.size());
  }

  void take_request(const httplib::Request& request, httplib::Response& response) {
    const auto refuse = [&response](int status, const std::string& why) {
      response.status = status;
      response.set_content(why + "\n", "text/plain");
    };
    // Forms of other sites cannot send this type without asking first.
    std::string type = request.get_header_value("Content-Type");
    type.resize(std::min(type.size(), type.find_first_of("; ")));  // without its character set
    if (type != "application/json") {
      refuse(415, "expected Content-Type: application/json");
      return;
    }
    try {
      const LiveRequest asked = parse_live_request(request.body, options.num_agents);
      const std::lock_guard lock(mutex);
      if (requests.size() >= kMaxWaitingMessages) {
        refuse(503, "too many requests wait");
        return;
      }
      requests.push_back(asked);
      response.status = 204;
    } catch (const Error& error) {
      refuse(400, error.what());
    }
    changed.notify_all();
  }

  // With the mutex held.
  static void put(Listener& listener, const Text& text) {
    listener.bytes += text->size();
    listener.waiting.push_back(text);
    if (listener.waiting.size() <= kMaxWaitingMessages && listener.bytes <= kMaxWaitingBytes) return;
    listener.waiting.clear();
    listener.bytes = 0;
    listener.is_greeted = false;
  }
  static bool is_newcomer(const std::shared_ptr<Listener>& listener) {
    return !listener->is_greeted && listener->waiting.empty() && !listener->is_writing;
  }

  static constexpr const char* kLiveElement = "<script type=\"text/plain\" id=\"replay-live\">events</script>";

  const LiveServerOptions options;
  const std::string host_name;  // in lower case
  const std::string token;
  httplib::Server server;
  std::thread thread;
  int port = 0;
  std::string address;
  std::vector<std::string> hosts;

  mutable std::mutex mutex;  // of all that follows
  std::condition_variable changed;
  std::vector<std::shared_ptr<Listener>> listeners;
  std::vector<LiveRequest> requests;
  bool is_closing = false;
};

bool can_serve() { return true; }

LiveServer::LiveServer(const LiveServerOptions& options) : parts_(std::make_unique<Parts>(options)) {}

LiveServer::~LiveServer() = default;

const std::string& LiveServer::address() const { return parts_->address; }

void LiveServer::send(std::string_view event, const std::function<LiveJson()>& message) {
  const auto wants = [](const auto& listener) { return listener->is_greeted; };
  {
    const std::lock_guard lock(parts_->mutex);
    if (std::none_of(parts_->listeners.begin(), parts_->listeners.end(), wants)) return;
  }
  const Text text = event_text(event, message());  // outside of the lock, since it takes its time
  {
    const std::lock_guard lock(parts_->mutex);
    for (const auto& listener : parts_->listeners) {
      if (wants(listener)) Parts::put(*listener, text);
    }
  }
  parts_->changed.notify_all();
}

bool LiveServer::has_newcomers() const {
  const std::lock_guard lock(parts_->mutex);
  return std::any_of(parts_->listeners.begin(), parts_->listeners.end(), Parts::is_newcomer);
}

void LiveServer::greet(const std::vector<Message>& messages) {
  std::vector<Text> texts;
  for (const Message& message : messages) texts.push_back(event_text(message.event, message.data));
  {
    const std::lock_guard lock(parts_->mutex);
    for (const auto& listener : parts_->listeners) {
      if (!Parts::is_newcomer(listener)) continue;
      listener->is_greeted = true;
      for (const Text& text : texts) Parts::put(*listener, text);
    }
  }
  parts_->changed.notify_all();
}

std::vector<LiveRequest> LiveServer::take_requests() {
  const std::lock_guard lock(parts_->mutex);
  return std::exchange(parts_->requests, {});
}

void LiveServer::wait_until(Clock::time_point end) {
  std::unique_lock lock(parts_->mutex);
  parts_->changed.wait_until(lock, end, [this] {
    return !parts_->requests.empty() ||
           std::any_of(parts_->listeners.begin(), parts_->listeners.end(), Parts::is_newcomer);
  });
}

int LiveServer::num_pages() const {
  const std::lock_guard lock(parts_->mutex);
  return static_cast<int>(parts_->listeners.size());
}

void LiveServer::flush(std::chrono::milliseconds patience) {
  std::unique_lock lock(parts_->mutex);
  parts_->changed.wait_for(lock, patience, [this] {
    return std::all_of(parts_->listeners.begin(), parts_->listeners.end(),
                       [](const auto& listener) { return listener->waiting.empty() && !listener->is_writing; });
  });
}

#else

struct LiveServer::Parts {
  std::string address;
};

bool can_serve() { return false; }

LiveServer::LiveServer(const LiveServerOptions& /*options*/) {
  fail_usage("--serve: this build cannot serve pages: install libcpp-httplib-dev and build again");
}
LiveServer::~LiveServer() = default;
const std::string& LiveServer::address() const { return parts_->address; }
void LiveServer::send(std::string_view /*event*/, const std::function<LiveJson()>& /*message*/) {}
bool LiveServer::has_newcomers() const { return false; }
void LiveServer::greet(const std::vector<Message>& /*messages*/) {}
std::vector<LiveRequest> LiveServer::take_requests() { return {}; }
void LiveServer::wait_until(std::chrono::steady_clock::time_point /*end*/) {}
int LiveServer::num_pages() const { return 0; }
void LiveServer::flush(std::chrono::milliseconds /*patience*/) {}

#endif

}  // namespace pictura
