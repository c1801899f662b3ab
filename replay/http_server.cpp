#include "pictura/replay/http_server.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <system_error>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "pictura/common/support/numbers.h"

namespace pictura {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kMaxWriteTime{20};
// Limits for reading the rest of a request before a connection is closed. Without this reading, a client that is still
// writing would lose the answer.
constexpr std::chrono::seconds kMaxRestTime{1};
constexpr size_t kMaxRestBytes = size_t{1} << 20;

const char* reason_of(int status) {
  switch (status) {
    case 200: return "OK";
    case 204: return "No Content";
    case 400: return "Bad Request";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed";
    case 413: return "Content Too Large";
    case 415: return "Unsupported Media Type";
    case 431: return "Request Header Fields Too Large";
    case 501: return "Not Implemented";
    case 503: return "Service Unavailable";
    default: return "Error";
  }
}

// Waits for events of the socket. Returns false if none occurs before `end`.
bool wait_for(int socket, short events, Clock::time_point end) {
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return false;
    pollfd polled{socket, events, 0};
    const int ready = poll(&polled, 1, static_cast<int>(left));
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

/// Appends up to `size` received bytes. Returns false if the connection ends or the time `end` is reached.
bool read_some(int socket, size_t size, Clock::time_point end, std::string* text) {
  std::array<char, 4096> bytes;
  for (;;) {
    const ssize_t got = recv(socket, bytes.data(), std::min(size, bytes.size()), 0);
    if (got > 0) {
      text->append(bytes.data(), static_cast<size_t>(got));
      return Clock::now() < end;
    }
    if (got == 0) return false;
    if (errno == EINTR) continue;
    if ((errno != EAGAIN && errno != EWOULDBLOCK) || !wait_for(socket, POLLIN, end)) return false;
  }
}

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::string_view without_spaces(std::string_view text) {
  const size_t first = text.find_first_not_of(" \t");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Parses the head of a request: all lines before the body.
HttpRequest parse_head(std::string_view head) {
  const auto next_line = [&head] {
    const size_t end = head.find("\r\n");
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(end == head.npos ? head.size() : end + 2);
    return line;
  };
  const std::string_view line = next_line();
  const size_t path = line.find(' '), version = line.find(' ', path + 1);
  if (path == line.npos || version == line.npos || line[path + 1] != '/' ||
      (line.substr(version) != " HTTP/1.1" && line.substr(version) != " HTTP/1.0")) {
    throw HttpError{400, "expected METHOD /PATH HTTP/1.1"};
  }
  HttpRequest request;
  request.method = line.substr(0, path);
  request.path = line.substr(path + 1, version - path - 1);
  request.path.resize(std::min(request.path.size(), request.path.find('?')));
  while (!head.empty()) {
    const std::string_view field = next_line();
    const size_t colon = field.find(':');
    if (colon == field.npos || colon == 0 || field.substr(0, colon).find_first_of(" \t") != field.npos) {
      throw HttpError{400, "expected NAME: VALUE in the header"};
    }
    request.fields.emplace_back(in_lower_case(field.substr(0, colon)), without_spaces(field.substr(colon + 1)));
  }
  return request;
}

size_t body_bytes(const HttpRequest& request) {
  if (request.count("transfer-encoding") > 0) throw HttpError{501, "transfer codings are not supported"};
  for (const auto& [name, value] : request.fields) {
    if (name == "content-encoding" && in_lower_case(value) != "identity")
      throw HttpError{415, "encodings are not supported"};
  }
  if (request.count("content-length") == 0) return 0;
  const std::optional<uint64_t> bytes = parse_unsigned(request.value("content-length"));
  if (request.count("content-length") > 1 || !bytes) throw HttpError{400, "expected one Content-Length, a number"};
  if (*bytes > kMaxRequestBodyBytes) throw HttpError{413, "the request is too long"};
  return *bytes;
}

/// Reads a request. Returns nothing if the connection ends or the time is over before the request is complete. Throws
/// HttpError for an invalid request.
std::optional<HttpRequest> read_request(int socket) {
  const Clock::time_point end = Clock::now() + kMaxRequestTime;
  constexpr std::string_view kHeadEnd = "\r\n\r\n";
  std::string text;
  size_t head;
  while ((head = text.find(kHeadEnd)) == text.npos) {
    if (text.size() >= kMaxRequestHeadBytes) throw HttpError{431, "the header is too long"};
    if (!read_some(socket, kMaxRequestHeadBytes - text.size(), end, &text)) return std::nullopt;
  }
  HttpRequest request = parse_head(std::string_view(text).substr(0, head));
  const size_t size = body_bytes(request);
  request.body = text.substr(head + kHeadEnd.size());
  while (request.body.size() < size) {
    if (!read_some(socket, size - request.body.size(), end, &request.body)) return std::nullopt;
  }
  request.body.resize(size);
  return request;
}

// Reads until the client has closed its side of the connection, within limits.
void read_rest(int socket) {
  shutdown(socket, SHUT_WR);
  const Clock::time_point end = Clock::now() + kMaxRestTime;
  std::string rest;
  for (size_t bytes = 0; bytes < kMaxRestBytes && read_some(socket, kMaxRestBytes, end, &rest); rest.clear()) {
    bytes += rest.size();
  }
}

}  // namespace

int HttpRequest::count(std::string_view field) const {
  return static_cast<int>(
      std::count_if(fields.begin(), fields.end(), [&](const auto& its) { return its.first == field; }));
}

std::string_view HttpRequest::value(std::string_view field) const {
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const auto& its) { return its.first == field; });
  return found == fields.end() ? std::string_view() : found->second;
}

void HttpAnswer::send(int status, std::string_view type, std::string_view content) {
  std::string text = fmt::format("HTTP/1.1 {} {}\r\n{}Connection: close\r\n", status, reason_of(status), fields_);
  if (status != 204) text += fmt::format("Content-Type: {}\r\nContent-Length: {}\r\n", type, content.size());
  text += "\r\n";
  text += content;
  write(text);
}

bool HttpAnswer::begin_stream(std::string_view type) {
  return write(fmt::format("HTTP/1.1 200 OK\r\n{}Connection: close\r\nContent-Type: {}\r\n\r\n", fields_, type));
}

bool HttpAnswer::write(std::string_view bytes) {
  const Clock::time_point end = Clock::now() + kMaxWriteTime;
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      bytes.remove_prefix(static_cast<size_t>(sent));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      if (!wait_for(socket_, POLLOUT, end)) return false;
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

HttpServer::HttpServer(bool everywhere, int port, int num_threads, std::string fields, Handler handler)
    : fields_(std::move(fields)), handler_(std::move(handler)), sockets_(static_cast<size_t>(num_threads), -1) {
  const auto check = [this](bool is_done, const char* what) {
    if (is_done) return;
    const int error = errno;
    if (listening_ >= 0) close(listening_);
    throw std::system_error(error, std::generic_category(), what);
  };
  listening_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  check(listening_ >= 0, "socket");
  const int yes = 1;  // allows a port that another server used until recently
  setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(everywhere ? INADDR_ANY : INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(port));
  socklen_t size = sizeof address;
  check(bind(listening_, reinterpret_cast<const sockaddr*>(&address), size) == 0, "bind");
  check(listen(listening_, SOMAXCONN) == 0, "listen");
  check(getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &size) == 0, "getsockname");
  port_ = ntohs(address.sin_port);
  for (size_t thread = 0; thread < sockets_.size(); ++thread) {
    threads_.emplace_back([this, thread] { answer_connections(thread); });
  }
}

HttpServer::~HttpServer() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    // After a shutdown, all calls that wait for these sockets return.
    shutdown(listening_, SHUT_RDWR);
    for (const int socket : sockets_) {
      if (socket >= 0) shutdown(socket, SHUT_RDWR);
    }
  }
  for (std::thread& thread : threads_) thread.join();
  close(listening_);
}

void HttpServer::answer_connections(size_t thread) {
  for (;;) {
    const int socket = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    {
      const std::lock_guard lock(mutex_);
      if (is_ending_) {
        if (socket >= 0) close(socket);
        return;
      }
      sockets_[thread] = socket;
    }
    if (socket < 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));  // waits until descriptors are available again
      continue;
    }
    answer_one(socket);
    const std::lock_guard lock(mutex_);
    sockets_[thread] = -1;
    close(socket);
  }
}

void HttpServer::answer_one(int socket) const {
  const int yes = 1;
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  HttpAnswer answer(socket, fields_);
  try {
    const std::optional<HttpRequest> request = read_request(socket);
    if (!request) return;
    handler_(*request, answer);
  } catch (const HttpError& refusal) {
    answer.send(refusal.status, "text/plain", refusal.why + "\n");
  } catch (const std::bad_alloc&) {
    return;
  }
  read_rest(socket);
}

}  // namespace pictura
