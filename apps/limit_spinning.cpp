// Limits the spinning of Torch's threads. Torch's loops run on libgomp, whose waiting threads spin for milliseconds. If
// one other process is busy, this makes the loops ten times slower: threads use up their processor time by spinning,
// and are suspended when work arrives. GOMP_SPINCOUNT limits the spinning. But libgomp reads the environment once,
// before main() and all constructors of the program. So the command sets the variable and restarts itself, unless the
// environment already specifies how threads wait. It restarts before libraries are initialised, because their
// initialisation takes most of the start-up time.
#include <array>
#include <string_view>

#include <alloca.h>
#include <sys/auxv.h>
#include <unistd.h>

namespace {

// About 40 us of spinning. This is the shortest limit that costs no speed on an idle machine
// (docs/research/benchmarks.md). bindings/pictura/__init__.py sets the same value.
char spin_count[] = "GOMP_SPINCOUNT=2000";

// Runs before the standard library is initialised.
void limit_spinning(int /*argc*/, char** argv, char** environment) {
  size_t count = 0;
  for (; environment[count] != nullptr; ++count) {
    const std::string_view variable = environment[count];
    if (variable.starts_with("OMP_WAIT_POLICY=") || variable.starts_with("GOMP_SPINCOUNT=")) return;
  }
  if (getauxval(AT_BASE) == 0) return;  // the command was started through the dynamic linker
  std::array<char, 4096> path;
  const ssize_t length = readlink("/proc/self/exe", path.data(), path.size() - 1);
  if (length <= 0) return;
  path[length] = '\0';
  auto** const with_count = static_cast<char**>(alloca((count + 2) * sizeof(char*)));
  for (size_t i = 0; i < count; ++i) with_count[i] = environment[i];
  with_count[count] = spin_count;
  with_count[count + 1] = nullptr;
  execve(path.data(), argv, with_count);
  // If execve fails, the command continues unchanged.
}

[[gnu::section(".preinit_array"), gnu::used]] void (*before_libraries)(int, char**, char**) = limit_spinning;

}  // namespace
