// dtr/base/trace.h -- what a process does and when: the Trace Event format of ui.perfetto.dev and
// chrome://tracing. scripts/scaling computes from it what more cores would gain.
#pragma once
#include <functional>
#include <string>

namespace dtr::trace {

/// Records from now on, until End, outside any loop.
void Begin();
bool IsOn();

/// A new stage begins; the one before ends.
void Stage(const std::string& name);

/// ParallelFor's: runs `loop` on the body that it hands over, which records the items. `threads`:
/// of the loop, at most.
void Loop(int threads, const std::function<void(int)>& body,
          const std::function<void(const std::function<void(int)>&)>& loop);

/// Ends the recording. JSON of complete events ("X"): ts and dur of the wall clock, tts and tdur of
/// the thread's processor time, microseconds. Categories: "process" from Begin to End; "stage";
/// "loop", a call of ParallelFor, args {loop, threads}; "item", items of a loop that a thread ran
/// one after another, args {loop, count}, one each unless they are shorter than 100 us.
std::string End();

}  // namespace dtr::trace
