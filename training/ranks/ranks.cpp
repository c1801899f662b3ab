#include "pictura/training/ranks/ranks.h"

#include <chrono>
#include <memory>
#include <optional>
#include <sstream>

#include <fmt/ranges.h>
#include <torch/csrc/distributed/c10d/PrefixStore.hpp>
#include <torch/csrc/distributed/c10d/TCPStore.hpp>

#include "pictura/common/error.h"

namespace pictura {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kBetweenBeats{500};
// Time limit of one request to the store, once all ranks have met there.
constexpr milliseconds kStoreTimeout{20000};
constexpr milliseconds kShutdownTimeout{5000};  // for the other ranks to leave before the store closes

milliseconds milliseconds_of(double seconds) { return milliseconds(static_cast<int64_t>(1000 * seconds)); }

std::string first_line(const c10::Error& error) {
  const std::string text = error.what_without_backtrace();
  return text.substr(0, text.find('\n'));
}

std::vector<std::string> keys_of_ranks(const std::string& name, int size) {
  std::vector<std::string> keys;
  for (int rank = 0; rank < size; ++rank) keys.push_back(fmt::format("{}/{}", name, rank));
  return keys;
}

// Heartbeat that a rank writes twice a second.
struct Beat {
  int64_t number = 0, steps = 0;
  bool is_busy = false, has_left = false;

  std::string text() const { return fmt::format("{} {} {} {}", number, steps, int{is_busy}, int{has_left}); }
  static Beat of(const std::vector<uint8_t>& bytes) {
    Beat beat;
    std::istringstream(std::string(bytes.begin(), bytes.end())) >> beat.number >> beat.steps >> beat.is_busy >>
        beat.has_left;
    return beat;
  }
};

const std::string kFault = "fault";

}  // namespace

Ranks::Ranks(const Launch& launch, const RankTimeouts& timeouts)
    : launch_(launch), timeouts_(timeouts), no_progress_s_(timeouts.no_progress_s) {
  if (size() == 1) return;
  join();
  watcher_ = std::thread([this] { watch(); });
}

void Ranks::join() {
  const std::string meeting = fmt::format("{}:{} (MASTER_ADDR:MASTER_PORT)", launch_.address, launch_.port);
  c10d::TCPStoreOptions options;
  options.port = static_cast<uint16_t>(launch_.port);
  options.isServer = rank() == 0 && !launch_.is_served;
  options.waitWorkers = false;
  options.timeout = milliseconds_of(timeouts_.join_s);
  try {
    const auto tcp = c10::make_intrusive<c10d::TCPStore>(launch_.address, options);
    store_ = c10::make_intrusive<c10d::PrefixStore>(fmt::format("pictura/{}", launch_.attempt), tcp);
    watch_store_ = store_->clone();
  } catch (const c10::Error& error) {
    if (options.isServer) fail("rank 0: cannot listen at {}: {}", meeting, first_line(error));
    fail("rank {}: cannot reach {}: {}", rank(), meeting, first_line(error));
  }
  try {
    if (rank() == 0) store_->set(kFault, "");
    store_->set(fmt::format("beat/{}", rank()), Beat{}.text());
    PICTURA_CHECK(
        store_->add(fmt::format("joined/{}", rank()), 1) == 1,
        "rank {}: another process at {} already has this rank: give every process its own RANK, and every run "
        "its own MASTER_PORT",
        rank(), meeting);
    const Clock::time_point end = Clock::now() + milliseconds_of(timeouts_.join_s);
    std::vector<int> missing;
    do {
      missing.clear();
      for (int other = 0; other < size(); ++other) {
        if (!store_->check({fmt::format("joined/{}", other)})) missing.push_back(other);
      }
      std::this_thread::sleep_for(milliseconds(missing.empty() ? 0 : 50));
    } while (!missing.empty() && Clock::now() < end);
    PICTURA_CHECK(missing.empty(), "rank {}: {} of {} ranks did not reach {} within {:.0f} s: {}", rank(),
                  missing.size(), size(), meeting, timeouts_.join_s, fmt::join(missing, ", "));
    store_->setTimeout(kStoreTimeout);
  } catch (const c10::Error& error) {
    fail("rank {}: lost {}: {}", rank(), meeting, first_line(error));
  }
}

Ranks::~Ranks() {
  if (!watcher_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  watcher_.join();
  if (rank() != 0 || launch_.is_served) return;
  // Waits for the other ranks, because the store ends with this process.
  try {
    const Clock::time_point end = Clock::now() + kShutdownTimeout;
    while (store_->add("left", 0) < size() && Clock::now() < end) std::this_thread::sleep_for(milliseconds(20));
  } catch (const c10::Error&) {
    // The store has already ended, which no longer matters.
  }
}

void Ranks::step() {
  ++steps_;
  check();
}

void Ranks::check() const {
  if (!is_lost_) return;
  const std::lock_guard lock(mutex_);
  throw RankLost(why_lost_);
}

void Ranks::throw_if_lost() const {
  if (size() == 1) return;
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, milliseconds_of(timeouts_.silent_s) + 4 * kBetweenBeats, [this] { return is_lost_.load(); });
  lock.unlock();
  check();
}

void Ranks::announce(const std::string& why) noexcept {
  // If a rank is lost, the store may be lost too, and the other ranks know of the loss.
  if (size() == 1 || is_lost_) return;
  try {
    store_->compareSet(kFault, "", fmt::format("rank {} ended: {}", rank(), why));
  } catch (const std::exception&) {
    // Ranks that cannot be reached detect the loss themselves.
  }
}

std::vector<std::string> Ranks::texts(const std::string& key, const std::string& own) {
  if (size() == 1) return {own};
  const std::vector<std::string> keys = keys_of_ranks(key, size());
  try {
    store_->set(keys[rank()], own);
    while (!store_->check(keys)) {
      check();
      std::this_thread::sleep_for(milliseconds(20));
    }
    std::vector<std::string> all;
    for (const std::vector<uint8_t>& bytes : store_->multiGet(keys)) all.emplace_back(bytes.begin(), bytes.end());
    return all;
  } catch (const c10::Error& error) {
    throw_if_lost();
    fail("rank {}: the ranks cannot exchange {}: {}", rank(), key, first_line(error));
  }
}

void Ranks::on_lost(std::function<void()> abort) {
  const std::lock_guard lock(mutex_);
  abort_ = std::move(abort);
}

void Ranks::mark_lost(const std::string& why) {
  const std::lock_guard lock(mutex_);
  why_lost_ = why;
  is_lost_ = true;
  if (abort_) abort_();
  changed_.notify_all();
}

namespace {

// Exchange of heartbeats through the store. A request to a store whose process was stopped never returns, so the
// exchange has its own thread, which is then abandoned.
struct Exchange {
  std::mutex mutex;  // guards all members below
  std::condition_variable changed;
  Beat own;
  bool ends = false, has_ended = false;
  std::vector<std::vector<uint8_t>> values;  // values of the last round; empty before the first
  Clock::time_point last_round = Clock::now();
  std::string error;  // why there are no more rounds

  void run(c10d::Store* store, const std::string& own_key, const std::vector<std::string>& keys) {
    std::unique_lock lock(mutex);
    try {
      while (!ends) {
        ++own.number;
        const std::string text = own.text();
        lock.unlock();
        store->set(own_key, text);
        std::vector<std::vector<uint8_t>> all = store->multiGet(keys);
        lock.lock();
        values = std::move(all);
        last_round = Clock::now();
        changed.wait_for(lock, kBetweenBeats, [this] { return ends; });
      }
      own.has_left = true;
      const std::string text = own.text();
      lock.unlock();
      store->set(own_key, text);
      store->add("left", 1);
      lock.lock();
    } catch (const c10::Error& failed) {
      if (!lock.owns_lock()) lock.lock();
      error = first_line(failed);
    }
    has_ended = true;
    changed.notify_all();
  }
};

double seconds_since(Clock::time_point time) { return std::chrono::duration<double>(Clock::now() - time).count(); }

// History of the ranks' heartbeats.
class BeatHistory {
 public:
  BeatHistory(int num_ranks, double silent_s) : silent_s_(silent_s), seen_(static_cast<size_t>(num_ranks)) {}

  // Adds the last round's heartbeats of all ranks. Returns the reason why a rank is lost; empty: no rank is lost.
  std::string add(const std::vector<Beat>& beats, double no_progress_s) {
    bool may_hang = true;
    std::optional<int64_t> minimum;
    for (size_t r = 0; r < seen_.size(); ++r) {
      const Beat& beat = beats[r];
      if (beat.number != seen_[r].beat.number) seen_[r].changed = Clock::now();
      seen_[r].beat = beat;
      may_hang = may_hang && !beat.is_busy && beat.steps > 0;
      if (beat.has_left) continue;
      minimum = std::min(minimum.value_or(beat.steps), beat.steps);
      if (seconds_since(seen_[r].changed) > silent_s_) {
        return fmt::format("rank {}: no heartbeat for {:.0f} s: it was killed or stopped, or its host is gone", r,
                           silent_s_);
      }
    }
    if (!may_hang || minimum.value_or(-1) != min_steps_) {
      min_steps_ = minimum.value_or(-1);
      progressed_ = Clock::now();
    }
    if (seconds_since(progressed_) <= no_progress_s) return "";
    std::vector<size_t> behind;
    for (size_t r = 0; r < seen_.size(); ++r) {
      if (!seen_[r].beat.has_left && seen_[r].beat.steps == min_steps_) behind.push_back(r);
    }
    return fmt::format("rank {}: alive, but no step for {:.0f} s: it hangs", fmt::join(behind, ", "), no_progress_s);
  }

 private:
  struct Seen {
    Beat beat;
    Clock::time_point changed = Clock::now();  // time of the last change of the heartbeat's number
  };
  double silent_s_;
  std::vector<Seen> seen_;
  int64_t min_steps_ = -1;
  Clock::time_point progressed_ = Clock::now();  // time of the last change of the minimum number of steps
};

}  // namespace

void Ranks::watch() {
  BeatHistory history(size(), timeouts_.silent_s);
  std::vector<std::string> keys = keys_of_ranks("beat", size());
  keys.push_back(kFault);
  const auto exchange = std::make_shared<Exchange>();
  std::thread exchanges(
      [exchange, keys, own_key = keys[rank()], store = watch_store_] { exchange->run(store.get(), own_key, keys); });
  // Returns why a rank is lost, if that is known; empty: no rank is lost.
  const auto look = [&]() -> std::string {
    std::vector<std::vector<uint8_t>> values;
    {
      const std::lock_guard lock(exchange->mutex);
      exchange->own.steps = steps_;
      exchange->own.is_busy = busy_ > 0;
      values = exchange->values;
      if (!exchange->error.empty() || seconds_since(exchange->last_round) > timeouts_.silent_s) {
        return fmt::format(
            "{}: {}:{}, where the ranks meet, does not answer: it was killed or stopped, or its host is "
            "gone{}{}",
            launch_.is_served ? "the launcher" : "rank 0", launch_.address, launch_.port,
            exchange->error.empty() ? "" : ": ", exchange->error);
      }
    }
    if (values.empty()) return "";
    const std::string fault(values.back().begin(), values.back().end());
    if (!fault.empty() && !fault.starts_with(fmt::format("rank {} ", rank()))) return fault;
    std::vector<Beat> beats;
    for (size_t r = 0; r + 1 < values.size(); ++r) beats.push_back(Beat::of(values[r]));
    return history.add(beats, no_progress_s_);
  };

  std::unique_lock lock(mutex_);
  while (!ends_) {
    lock.unlock();
    const std::string why = is_lost_ ? "" : look();
    if (!why.empty()) mark_lost(why);
    lock.lock();
    changed_.wait_for(lock, kBetweenBeats, [this] { return ends_; });
  }
  lock.unlock();

  std::unique_lock of_exchange(exchange->mutex);
  exchange->ends = true;
  exchange->changed.notify_all();
  const bool has_ended =
      exchange->changed.wait_for(of_exchange, 2 * kBetweenBeats, [&] { return exchange->has_ended; });
  of_exchange.unlock();
  if (has_ended || !is_lost_) {
    exchanges.join();
  } else {
    exchanges.detach();
  }
}

}  // namespace pictura
