// Small HTTP server for pages in this machine's browsers: one request per connection, without ranges, encodings or
// transfer codings. The cost of a connection is limited before its request is parsed: bytes of the request, time to
// read it, time to write an answer, and threads.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace pictura {

struct HttpRequest {
  std::string method;
  std::string path;                                         // without query
  std::vector<std::pair<std::string, std::string>> fields;  // fields of the header: names in lower case, values
  std::string body;

  int count(std::string_view field) const;
  /// Returns the value of the first field of this name, or an empty text.
  std::string_view value(std::string_view field) const;
};

/// Exception for a request that is refused.
struct HttpError {
  int status;
  std::string why;
};

/// Writes the answer to one request.
class HttpAnswer {
 public:
  HttpAnswer(int socket, std::string_view fields) : socket_(socket), fields_(fields) {}

  /// Sends a complete answer.
  void send(int status, std::string_view type, std::string_view content);
  /// Begins an answer that ends with its connection.
  bool begin_stream(std::string_view type);
  /// Writes bytes. Returns whether the connection is still open.
  bool write(std::string_view bytes);

 private:
  int socket_;
  std::string_view fields_;
};

constexpr size_t kMaxRequestHeadBytes = 16384, kMaxRequestBodyBytes = 4096;
constexpr std::chrono::seconds kMaxRequestTime{5};  // for the whole request to arrive

class HttpServer {
 public:
  using Handler = std::function<void(const HttpRequest&, HttpAnswer&)>;

  /// Listens on the loopback, or on all addresses, at `port` (0: a free one), which it shares with no other server.
  /// Answers num_threads requests at a time by calls of `handler`, which may throw HttpError; `fields`, header lines,
  /// are part of every answer. Throws std::system_error if it cannot listen.
  HttpServer(bool everywhere, int port, int num_threads, std::string fields, Handler handler);
  /// Closes all connections. Handlers that wait for anything except their connection must be made to return before this
  /// call.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const { return port_; }

 private:
  void answer_connections(size_t thread);
  void answer_one(int socket) const;

  const std::string fields_;
  const Handler handler_;
  int listening_ = -1;
  int port_ = 0;
  std::mutex mutex_;  // guards the members below
  bool is_ending_ = false;
  std::vector<int> sockets_;  // connection of each thread, or -1
  std::vector<std::thread> threads_;
};

}  // namespace pictura
