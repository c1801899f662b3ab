// Torch's loops run on libgomp, whose waiting threads spin for milliseconds. Beside one busy process that makes them
// ten times slower: threads that have spun their share of the processor away are not there when work comes.
// GOMP_SPINCOUNT limits it, but libgomp reads the environment once, before main and every constructor of the program.
// So the command sets the variable, unless the environment says how threads wait, and starts itself again, before
// libraries set themselves up, which takes most of the start.
#include <array>
#include <string_view>

#include <alloca.h>
#include <sys/auxv.h>
#include <unistd.h>

namespace {

// About 40 us: the shortest that costs nothing on an idle machine (docs/research/benchmarks.md).
// bindings/pictura/__init__.py has it too.
char spin_count[] = "GOMP_SPINCOUNT=2000";

// Nothing of the standard library is set up yet.
void limit_spinning(int /*argc*/, char** argv, char** environment) {
  size_t count = 0;
  for (; environment[count] != nullptr; ++count) {
    const std::string_view variable = environment[count];
    if (variable.starts_with("OMP_WAIT_POLICY=") || variable.starts_with("GOMP_SPINCOUNT=")) return;
  }
  if (getauxval(AT_BASE) == 0) return;  // started by the name of the dynamic linker
  std::array<char, 4096> path;
  const ssize_t length = readlink("/proc/self/exe", path.data(), path.size() - 1);
  if (length <= 0) return;
  path[length] = '\0';
  auto** const with_count = static_cast<char**>(alloca((count + 2) * sizeof(char*)));
  for (size_t i = 0; i < count; ++i) with_count[i] = environment[i];
  with_count[count] = spin_count;
  with_count[count + 1] = nullptr;
  execve(path.data(), argv, with_count);
  // Where that fails, the command runs as it is.
}

[[gnu::section(".preinit_array"), gnu::used]] void (*before_libraries)(int, char**, char**) = limit_spinning;

}  // namespace
