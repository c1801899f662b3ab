// Runs the pictura command for many test cases. Each case runs in a child of this process, which has already loaded the
// command's libraries; loading them takes most of the time of a start. The standard input is a socket of packets from
// tests/apps/command_case.py. A packet has four descriptors: the three standard streams, and the descriptor for the
// answer. Its text consists of strings that end with zero bytes: the working folder, the number of environment
// variables, the variables, the number of words of the command line, and the words. The answer is the child's process
// id and, after the child has ended, its status, both as int32.
#include <array>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pictura/apps/command.h"

namespace {

constexpr int kNumDescriptors = 4;
constexpr int kAnswer = 3;  // index of a descriptor
using Descriptors = std::array<int, kNumDescriptors>;

/// Takes the texts of a packet one after the other.
class Texts {
 public:
  explicit Texts(std::string packet) : packet_(std::move(packet)) {}

  char* next() {
    char* const text = packet_.data() + at_;
    at_ += std::strlen(text) + 1;
    return text;
  }
  std::vector<char*> list() {
    std::vector<char*> texts(std::strtoul(next(), nullptr, 10));
    for (char*& text : texts) text = next();
    return texts;
  }

 private:
  std::string packet_;
  size_t at_ = 0;
};

/// Receives a packet. Returns false at the end of the socket.
bool receive(std::string* packet_out, Descriptors* descriptors_out) {
  packet_out->resize(1 << 20);
  iovec memory{packet_out->data(), packet_out->size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(Descriptors))> control{};
  msghdr message{};
  message.msg_iov = &memory;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = recvmsg(STDIN_FILENO, &message, 0);
  if (size <= 0) return false;
  packet_out->resize(static_cast<size_t>(size));
  std::memcpy(descriptors_out->data(), CMSG_DATA(CMSG_FIRSTHDR(&message)), sizeof(Descriptors));
  return true;
}

[[noreturn]] void run(std::string packet, const Descriptors& descriptors) {
  for (int stream = 0; stream < kAnswer; ++stream) dup2(descriptors[stream], stream);
  for (const int descriptor : descriptors) close(descriptor);
  Texts texts(std::move(packet));
  if (chdir(texts.next()) != 0) std::_Exit(127);
  clearenv();
  for (char* const variable : texts.list()) putenv(variable);
  std::vector<char*> words = texts.list();
  const auto count = static_cast<int>(words.size());
  words.push_back(nullptr);
  // Skips the destructors of static objects, since torch's take as long as its loading. Outputs are closed.
  std::_Exit(pictura::run_command(count, words.data()));
}

void answer(const Descriptors& descriptors, int32_t number) {
  if (write(descriptors[kAnswer], &number, sizeof(number)) != sizeof(number)) std::_Exit(1);
}

}  // namespace

int main() {
  std::signal(SIGCHLD, SIG_IGN);  // removes ended children automatically
  std::string packet;
  Descriptors descriptors{};
  while (receive(&packet, &descriptors)) {
    if (fork() == 0) {
      std::signal(SIGCHLD, SIG_DFL);
      const pid_t child = fork();
      if (child == 0) run(packet, descriptors);
      answer(descriptors, child);
      int status = 0;
      waitpid(child, &status, 0);
      answer(descriptors, status);
      std::_Exit(0);
    }
    for (const int descriptor : descriptors) close(descriptor);
  }
}
