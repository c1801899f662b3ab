// Small HTTP server for browser pages, with limited request size, times and threads. A connection carries one request.
// Ranges, encodings and transfer codings are not supported.
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
  std::string path;  // without query
  // Names in lower case, and values.
  std::vector<std::pair<std::string, std::string>> fields;
  std::string body;

  int count(std::string_view field) const;
  /// Returns the first field's value, or an empty text.
  std::string_view value(std::string_view field) const;
};

/// Thrown by a handler that refuses a request.
struct HttpError {
  int status;
  std::string why;
};

class HttpAnswer {
 public:
  HttpAnswer(int socket, std::string_view fields) : socket_(socket), fields_(fields) {}

  void send(int status, std::string_view type, std::string_view content);
  /// Begins an answer that ends with the connection. Returns whether the connection is open.
  bool begin_stream(std::string_view type);
  /// Returns whether the connection is open.
  bool write(std::string_view bytes);

 private:
  int socket_;
  std::string_view fields_;
};

constexpr size_t kMaxRequestHeadBytes = 16384, kMaxRequestBodyBytes = 4096;
constexpr std::chrono::seconds kMaxRequestTime{5};  // until the whole request has arrived

class HttpServer {
 public:
  using Handler = std::function<void(const HttpRequest&, HttpAnswer&)>;

  /// Listens at `port` (0: any) on the loopback, or on all addresses if `everywhere`. Up to num_threads threads call
  /// `handler`, which may throw HttpError. `fields`: header lines of every answer. Throws std::system_error if
  /// listening fails.
  HttpServer(bool everywhere, int port, int num_threads, std::string fields, Handler handler);
  /// Closes all connections. The caller must first end handlers that wait for anything except their connection.
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
  std::mutex mutex_;
  bool is_ending_ = false;
  std::vector<int> sockets_;  // by thread; -1: no connection
  std::vector<std::thread> threads_;
};

}  // namespace pictura
