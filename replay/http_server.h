// A small HTTP server for pages of this machine's browsers: one request per connection, without ranges, encodings or
// transfer codings. What a connection may cost is limited before its request is looked at: bytes of the request, time
// to read it, time to write an answer, and threads.
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
  std::string path;                                         // without the query
  std::vector<std::pair<std::string, std::string>> fields;  // of the header: names in lower case, values
  std::string body;

  int count(std::string_view field) const;
  /// The first of this name, or nothing.
  std::string_view value(std::string_view field) const;
};

/// Thrown instead of an answer.
struct HttpRefusal {
  int status;
  std::string why;
};

/// Writes the answer of one request.
class HttpAnswer {
 public:
  HttpAnswer(int socket, std::string_view fields) : socket_(socket), fields_(fields) {}

  /// An answer that is complete.
  void send(int status, std::string_view type, std::string_view content);
  /// Begins an answer that ends with its connection.
  bool begin_stream(std::string_view type);
  /// Returns whether the connection goes on.
  bool write(std::string_view bytes);

 private:
  int socket_;
  std::string_view fields_;
};

constexpr size_t kMaxRequestHeadBytes = 16384, kMaxRequestBodyBytes = 4096;
constexpr std::chrono::seconds kMaxRequestTime{5};  // to come, all of it

class HttpServer {
 public:
  using Handler = std::function<void(const HttpRequest&, HttpAnswer&)>;

  /// Listens on the loopback, or everywhere, at `port` (0: a free one), which it shares with no other server. Answers
  /// num_threads requests at a time by calls of `handler`, which may throw HttpRefusal; `fields`, lines of a header,
  /// are part of every answer. Throws std::system_error where it cannot listen.
  HttpServer(bool everywhere, int port, int num_threads, std::string fields, Handler handler);
  /// Ends all connections. Handlers that wait for anything else than their connection must have been told to return.
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
  std::mutex mutex_;  // of what follows
  bool is_ending_ = false;
  std::vector<int> sockets_;  // of each thread: its connection's, or -1
  std::vector<std::thread> threads_;
};

}  // namespace pictura
