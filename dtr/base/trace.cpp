#include "dtr/base/trace.h"

#include <cxxabi.h>
#include <time.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <typeindex>
#include <vector>

namespace dtr::trace {
namespace {

constexpr double kShortUs = 100;  // items of no more are recorded together
constexpr int kAll = 0;           // `loop` of what is no loop's

double MicrosecondsOf(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

struct Event {
  enum class Kind { kProcess, kStage, kLoop, kItem } kind;
  int loop, count;  // count: threads of a loop, or items
  double wall_us, cpu_us, wall_end_us, cpu_end_us;
  std::string stage = {};
};

/// Of one thread; its own alone until End.
struct Record {
  int thread;
  std::vector<Event> events;
  int last_item = -1;  // index of the event that the next short item may join
};

std::atomic<bool> is_on = false;
std::mutex mutex;  // of what follows
std::deque<Record> records;
std::map<int, std::type_index> bodies;  // of each loop
int loops = 0;
std::vector<Event> stages;
double start_wall_us = 0, start_cpu_us = 0;

Record& OfThread() {
  thread_local Record* own = nullptr;
  if (own == nullptr) {
    const std::lock_guard lock(mutex);
    own = &records.emplace_back(Record{static_cast<int>(records.size()), {}});
  }
  return *own;
}

Event Started(Event::Kind kind, int loop, int count) {
  return {
      kind, loop, count, MicrosecondsOf(CLOCK_MONOTONIC), MicrosecondsOf(CLOCK_THREAD_CPUTIME_ID),
      0,    0};
}

void Finish(Event* event) {
  event->wall_end_us = MicrosecondsOf(CLOCK_MONOTONIC);
  event->cpu_end_us = MicrosecondsOf(CLOCK_THREAD_CPUTIME_ID);
}

void AddItem(Record& record, size_t events_before, const Event& item) {
  const bool nothing_inside = record.events.size() == events_before;
  if (nothing_inside && record.last_item + 1 == static_cast<int>(events_before) &&
      record.last_item >= 0) {
    Event& last = record.events[static_cast<size_t>(record.last_item)];
    if (last.loop == item.loop && item.wall_end_us - last.wall_us < kShortUs) {
      last.count += item.count;
      last.wall_end_us = item.wall_end_us;
      last.cpu_end_us = item.cpu_end_us;
      return;
    }
  }
  record.events.push_back(item);
  record.last_item = nothing_inside ? static_cast<int>(record.events.size()) - 1 : -1;
}

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return quoted + '"';
}

/// The function whose loop it is: as the compiler spells the type of its body.
std::string NameOf(const std::type_index& body) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> text(
      abi::__cxa_demangle(body.name(), nullptr, nullptr, &status), &std::free);
  std::string name = status == 0 ? text.get() : body.name();
  constexpr std::string_view kUnnamed = "(anonymous namespace)::";
  for (size_t at = name.find(kUnnamed); at != std::string::npos; at = name.find(kUnnamed)) {
    name.erase(at, kUnnamed.size());
  }
  return name.substr(0, name.find('('));
}

std::string LineOf(const Event& event, int thread) {
  const char* category = "item";
  std::string name, args;
  switch (event.kind) {
    case Event::Kind::kProcess:
      name = category = "process";
      break;
    case Event::Kind::kStage:
      category = "stage";
      name = event.stage;
      break;
    case Event::Kind::kLoop:
      category = "loop";
      args = ",\"threads\":" + std::to_string(event.count);
      break;
    case Event::Kind::kItem:
      args = ",\"count\":" + std::to_string(event.count);
      break;
  }
  if (event.loop != kAll) name = NameOf(bodies.at(event.loop));
  char times[160];
  std::snprintf(times, sizeof times, "\"ts\":%.1f,\"dur\":%.1f,\"tts\":%.1f,\"tdur\":%.1f",
                event.wall_us - start_wall_us, event.wall_end_us - event.wall_us, event.cpu_us,
                event.cpu_end_us - event.cpu_us);
  return "{\"name\":" + Quoted(name) + ",\"cat\":\"" + category +
         "\",\"ph\":\"X\",\"pid\":1,\"tid\":" + std::to_string(thread) + "," + times +
         ",\"args\":{\"loop\":" + std::to_string(event.loop) + args + "}}";
}

}  // namespace

void Begin() {
  start_wall_us = MicrosecondsOf(CLOCK_MONOTONIC);
  start_cpu_us = MicrosecondsOf(CLOCK_THREAD_CPUTIME_ID);
  OfThread();  // thread 0
  is_on = true;
}

bool IsOn() { return is_on.load(std::memory_order_relaxed); }

void Stage(const std::string& name) {
  if (!IsOn()) return;
  Event next = Started(Event::Kind::kStage, kAll, 0);
  next.stage = name;
  const std::lock_guard lock(mutex);
  if (!stages.empty()) Finish(&stages.back());
  stages.push_back(std::move(next));
}

void Loop(int threads, const std::function<void(int)>& body,
          const std::function<void(const std::function<void(int)>&)>& loop) {
  int number = 0;
  {
    const std::lock_guard lock(mutex);
    number = ++loops;
    bodies.emplace(number, body.target_type());
  }
  Event all = Started(Event::Kind::kLoop, number, threads);
  const auto end = [&] {
    Finish(&all);
    Record& record = OfThread();
    record.events.push_back(all);
    record.last_item = -1;
  };
  try {
    loop([&](int i) {
      Record& record = OfThread();
      const size_t before = record.events.size();
      Event item = Started(Event::Kind::kItem, number, 1);
      body(i);
      Finish(&item);
      AddItem(record, before, item);
    });
  } catch (...) {
    end();
    throw;
  }
  end();
}

std::string End() {
  is_on = false;
  const std::lock_guard lock(mutex);
  Event process{Event::Kind::kProcess, kAll, 0, start_wall_us, start_cpu_us, 0, 0};
  Finish(&process);
  std::string json = "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n" + LineOf(process, 0);
  if (!stages.empty()) Finish(&stages.back());
  for (const Event& stage : stages) json += ",\n" + LineOf(stage, 0);
  for (const Record& record : records) {
    for (const Event& event : record.events) json += ",\n" + LineOf(event, record.thread);
  }
  for (Record& record : records) record = {record.thread, {}};
  stages.clear();
  bodies.clear();
  return json + "\n]}\n";
}

}  // namespace dtr::trace
