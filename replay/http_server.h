// Small HTTP server for pages in browsers, mainly on this machine. Each connection carries one request. Ranges,
// encodings and transfer codings are not supported. The size of a request, the times to read it and to write an answer,
// and the number of threads are limited.
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
  std::string path;  // without the query
  // Fields of the header: name in lower case, and value.
  std::vector<std::pair<std::string, std::string>> fields;
  std::string body;

  int count(std::string_view field) const;
  /// Returns the value of the first field with this name, or an empty text.
  std::string_view value(std::string_view field) const;
};

/// Exception with which a handler refuses a request.
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
  /// Begins an answer that ends when the connection ends. Returns whether the connection is still open.
  bool begin_stream(std::string_view type);
  /// Writes bytes. Returns whether the connection is still open.
  bool write(std::string_view bytes);

 private:
  int socket_;
  std::string_view fields_;
};

constexpr size_t kMaxRequestHeadBytes = 16384, kMaxRequestBodyBytes = 4096;
constexpr std::chrono::seconds kMaxRequestTime{5};  // maximum time until the whole request has arrived

class HttpServer {
 public:
  using Handler = std::function<void(const HttpRequest&, HttpAnswer&)>;

  /// Listens at `port` (0: any free port) on the loopback, or on all addresses if `everywhere`. Up to num_threads
  /// threads call `handler`, which answers a request and may throw HttpError. Every answer contains `fields`, which are
  /// header lines. Throws std::system_error if the server cannot listen, for example because another server uses the
  /// port.
  HttpServer(bool everywhere, int port, int num_threads, std::string fields, Handler handler);
  /// Closes all connections. If a handler waits for anything except its connection, the caller must make the handler
  /// return before the destructor runs.
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
