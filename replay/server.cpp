#include "pictura/replay/server.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <system_error>

#include <sys/random.h>

#include "pictura/common/error.h"
#include "pictura/common/support/json_text.h"
#include "pictura/replay/http_server.h"
#include "pictura/replay/page_sources.h"
#include "pictura/replay/template.h"

namespace pictura {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTokenBytes = 16;
constexpr int kThreads = kMaxLivePages + 8;  // one for each listening page, and 8 for other requests
constexpr const char* kHeaderFields =
    "Cache-Control: no-store\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src "
    "'self'; worker-src blob:; img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "X-Content-Type-Options: nosniff\r\n";
constexpr std::chrono::seconds kHeartbeat{10};  // writing it reveals that a page has gone

std::string random_token() {
  std::array<unsigned char, kTokenBytes> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::generic_category(), "serve: the system gives no random numbers");
  }
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

// Compares texts of equal length in a time that does not depend on their contents, so that timing does not reveal a
// secret.
bool is_equal(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  int difference = 0;
  for (size_t i = 0; i < a.size(); ++i) difference |= a[i] ^ b[i];
  return difference == 0;
}

// Returns the host name as browsers send it. Throws UsageError if browsers could not send it as a name or an address.
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

/// A page that listens to events.
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
    const bool everywhere = !host_name.empty();
    try {
      server = std::make_unique<HttpServer>(
          everywhere, options.port, kThreads, kHeaderFields,
          [this](const HttpRequest& request, HttpAnswer& answer) { answer_request(request, answer); });
    } catch (const std::system_error& error) {
      fail("serve: cannot listen on {}:{}: {}", everywhere ? "0.0.0.0" : "127.0.0.1", options.port,
           error.code() == std::errc::address_in_use ? "is the port in use?" : error.code().message());
    }
    const int port = server->port();
    address = fmt::format("http://{}:{}/{}/", everywhere ? host_name : "127.0.0.1", port, token);
    const std::lock_guard lock(mutex);
    for (const std::string& name : {std::string("127.0.0.1"), std::string("localhost"), host_name}) {
      if (name.empty()) continue;
      hosts.push_back(fmt::format("{}:{}", name, port));
      if (port == 80) hosts.push_back(name);  // browsers omit port 80
    }
  }

  ~Parts() {
    {
      const std::lock_guard lock(mutex);
      is_closing = true;
    }
    changed.notify_all();
    server.reset();
  }

  void answer_request(const HttpRequest& request, HttpAnswer& answer) {
    check_asker(request);
    const std::string_view name = std::string_view(request.path).substr(token.size() + 2);
    const auto expect = [&request](std::string_view method) {
      if (request.method != method) throw HttpError{405, fmt::format("expected {}", method)};
    };
    if (name.empty()) {
      expect("GET");
      answer.send(200, "text/html; charset=utf-8",
                  fill_template(page::replay_html(), {{"title", "live"}, {"elements", kLiveElement}}));
    } else if (name == "events") {
      expect("GET");
      write_events(answer);
    } else if (name == "control") {
      expect("POST");
      take_request(request);
      answer.send(204, "", "");
    } else {
      throw HttpError{404, "not found"};
    }
  }

  // Rejects requests of other sites' pages, which can also reach the loopback. A site may point its own name at the
  // loopback, which the field Host reveals. Its pages may send requests to the loopback, which Origin and
  // Sec-Fetch-Site reveal.
  void check_asker(const HttpRequest& request) const {
    const std::string host(request.value("host"));
    const auto is_served = [&] {
      const std::lock_guard lock(mutex);
      return std::find(hosts.begin(), hosts.end(), host) != hosts.end();
    };
    if (request.count("host") != 1 || !is_served()) throw HttpError{403, "this host name is not served"};
    if (request.count("origin") > 0 && request.value("origin") != "http://" + host) {
      throw HttpError{403, "other origins are not served"};
    }
    const std::string_view site = request.value("sec-fetch-site");
    if (!site.empty() && site != "same-origin" && site != "none") throw HttpError{403, "other sites are not served"};
    const std::string_view path = request.path;
    if (path.size() < token.size() + 2 || !is_equal(path.substr(1, token.size()), token) ||
        path[token.size() + 1] != '/') {
      throw HttpError{404, "not found"};
    }
  }

  void write_events(HttpAnswer& answer) {
    auto listener = std::make_shared<Listener>();
    {
      const std::lock_guard lock(mutex);
      if (listeners.size() >= kMaxLivePages) {
        throw HttpError{503, fmt::format("{} pages are already connected", kMaxLivePages)};
      }
      listeners.push_back(listener);
    }
    changed.notify_all();
    if (answer.begin_stream("text/event-stream")) {
      while (write_next(*listener, answer)) continue;
    }
    {
      const std::lock_guard lock(mutex);
      listeners.erase(std::remove(listeners.begin(), listeners.end(), listener), listeners.end());
    }
    changed.notify_all();
  }

  // Writes the next waiting text, or a heartbeat. Returns whether the connection is still open.
  bool write_next(Listener& listener, HttpAnswer& answer) {
    Text text;
    {
      std::unique_lock lock(mutex);
      listener.is_writing = false;
      changed.notify_all();
      const bool has_news = changed.wait_for(lock, kHeartbeat, [&] { return is_closing || !listener.waiting.empty(); });
      if (is_closing) return false;
      if (has_news) {
        text = listener.waiting.front();
        listener.waiting.pop_front();
        listener.bytes -= text->size();
        listener.is_writing = true;
      }
    }
    return answer.write(text ? *text : ":\n\n");
  }

  void take_request(const HttpRequest& request) {
    // Pages of other sites cannot send this content type without a preflight request.
    std::string_view type = request.value("content-type");
    type = type.substr(0, type.find_first_of("; "));  // without the character set
    if (type != "application/json") throw HttpError{415, "expected Content-Type: application/json"};
    try {
      const LiveRequest asked = parse_live_request(request.body, options.num_agents);
      const std::lock_guard lock(mutex);
      if (requests.size() >= kMaxWaitingMessages) throw HttpError{503, "too many pending requests"};
      requests.push_back(asked);
    } catch (const Error& error) {
      throw HttpError{400, error.what()};
    }
    changed.notify_all();
  }

  // Queues a text for a page. The caller must hold the mutex.
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
  std::string address;

  mutable std::mutex mutex;  // guards all members below
  std::condition_variable changed;
  std::vector<std::string> hosts;
  std::vector<std::shared_ptr<Listener>> listeners;
  std::vector<LiveRequest> requests;
  bool is_closing = false;

  std::unique_ptr<HttpServer> server;  // last member: destroyed before the data that handlers read
};

LiveServer::LiveServer(const LiveServerOptions& options) : parts_(std::make_unique<Parts>(options)) {}

LiveServer::~LiveServer() = default;

const std::string& LiveServer::address() const { return parts_->address; }

void LiveServer::send(std::string_view event, const std::function<LiveJson()>& message) {
  const auto wants = [](const auto& listener) { return listener->is_greeted; };
  {
    const std::lock_guard lock(parts_->mutex);
    if (std::none_of(parts_->listeners.begin(), parts_->listeners.end(), wants)) return;
  }
  const Text text = event_text(event, message());  // without the lock, because it takes time
  {
    const std::lock_guard lock(parts_->mutex);
    for (const auto& listener : parts_->listeners) {
      if (wants(listener)) Parts::put(*listener, text);
    }
  }
  parts_->changed.notify_all();
}

bool LiveServer::has_ungreeted_pages() const {
  const std::lock_guard lock(parts_->mutex);
  return std::any_of(parts_->listeners.begin(), parts_->listeners.end(), Parts::is_newcomer);
}

void LiveServer::send_initial_events(const std::vector<Message>& messages) {
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

}  // namespace pictura
