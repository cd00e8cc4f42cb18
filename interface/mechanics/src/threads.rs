//! Threads inside a solver: a loop over tasks that the calling thread shares with the threads of a pool.
//!
//! The order in which tasks run is not fixed, so no task may depend on another one, and no sum on the order of threads:
//! each datum has one task that writes it ([`Threads::each`]), or results are added up in the order of the tasks
//! ([`Threads::in_order`]). Then any number of threads gives the same bits.
//!
//! Each thread has the same part of the tasks in every loop, since what a thread has just written is in its own cache;
//! when it has none left, it takes the last ones of the others. For the same reason each takes the results of the tasks
//! that it has run.
//!
//! A step has several short loops with little between them. To wake a thread costs as much as such a loop, so after a
//! loop a thread looks for the next one for a while ([`LOOKS`]), and only then sleeps: until the next step if the solver
//! waits for other processes in between. And a thread that is asleep, or that other programs keep from running, is
//! called but not waited for: the calling thread begins, and takes what the others have not begun.
//!
//! Rayon's own loops do not wait in this way. After each its threads call the system 33 times to give their processor
//! away, which beside other programs costs them milliseconds, and sleep then (docs/decisions/0006-waiting.md). So each
//! thread of the pool is in one job of ours all the time, to which the loops are lent ([`interface::lend`]): a loop of
//! nothing takes 0.5 us, where a scope of rayon took 2.7.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use interface::lend::{LOOKS, Lent, within};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::trial::Trial;

/// Number of the calling thread.
const CALLER: usize = 0;

/// How the loops of a solver are run: by the calling thread alone, or together with the threads of a pool.
#[derive(Debug, Clone, Default)]
pub struct Threads(Option<Arc<Pool>>);

impl Threads {
    /// The calling thread only.
    pub const fn alone() -> Self {
        Self(None)
    }

    /// `count` threads, including the caller's; the others are called `name` with a number. 1 is a plain loop.
    ///
    /// # Errors
    /// The error message of the operating system if it has no more threads.
    pub fn new(count: usize, name: &'static str) -> Result<Self, String> {
        if count <= 1 {
            return Ok(Self::alone());
        }
        let threads = ThreadPoolBuilder::new()
            .num_threads(count - 1)
            .thread_name(move |i| format!("{name}-{}", i + 1))
            .build()
            .map_err(|e| e.to_string())?;
        let calls = Arc::new(Calls::default());
        let attended = Arc::clone(&calls);
        threads.spawn_broadcast(move |thread| attended.attend(thread.index() + 1));
        Ok(Self(Some(Arc::new(Pool {
            threads,
            calls,
            shares: AtomicBool::new(true),
            trial: Mutex::default(),
        }))))
    }

    /// Number of threads that share the loops at present, including the caller's.
    pub fn count(&self) -> usize {
        match self.sharing() {
            Some(pool) => pool.threads.current_num_threads() + 1,
            None => 1,
        }
    }

    /// Length of the parts of a loop over `len` elements: `parts` for each thread, so that others can take work from a slow one,
    /// of a multiple of so many elements.
    pub fn part(&self, len: usize, parts: usize, multiple: usize) -> usize {
        match self.count() {
            1 => len.max(1),
            threads => (len.div_ceil(parts * threads).max(1)).next_multiple_of(multiple),
        }
    }

    /// The threads of the pool, if they share the loops at present.
    fn sharing(&self) -> Option<&Pool> {
        let pool = self.0.as_deref()?;
        pool.shares.load(Ordering::Relaxed).then_some(pool)
    }

    /// Runs a part of a step, the `first` or a later one. Its loops are shared if that has taken less time lately; those
    /// outside of steps are always.
    pub fn in_step<R>(&self, first: bool, act: impl FnOnce() -> R) -> R {
        let Some(pool) = &self.0 else { return act() };
        let trial = || pool.trial.lock().expect("nobody panics with the lock");
        if first {
            let shares = trial().begin_step();
            pool.shares.store(shares, Ordering::Relaxed);
        }
        let begin = trial().tries().then(Instant::now);
        let result = act();
        if let Some(begin) = begin {
            trial().took(begin.elapsed());
        }
        result
    }

    /// Calls `act` for every task.
    #[inline]
    pub fn each<T: Send>(&self, tasks: impl Iterator<Item = T> + Send, act: impl Fn(T) + Sync) {
        match self.sharing() {
            Some(pool) if tasks.size_hint().1 != Some(1) => {
                // Plain loops, here and where this is called: adaptors of iterators are compiled anew for each of a hundred
                // loops.
                let mut slots = Vec::with_capacity(tasks.size_hint().0);
                for task in tasks {
                    slots.push(Slot::new(task));
                }
                pool.share(slots.len(), &|i, _| act(slots[i].take()), &|_| {});
            }
            _ => {
                for task in tasks {
                    act(task);
                }
            }
        }
    }

    /// Calls `act` for every task and its place, and `take` for every place in the order of the tasks, as soon as the
    /// tasks up to it have run. So while one thread takes results, the others go on with tasks.
    pub fn in_order<'a, T: Send, S: Send + Sync + 'a>(
        &self,
        tasks: impl ExactSizeIterator<Item = (T, &'a mut S)> + Send,
        act: impl Fn(T, &mut S) + Sync,
        mut take: impl FnMut(&S) + Send,
    ) {
        let Some(pool) = self.sharing() else {
            for (task, place) in tasks {
                act(task, place);
                take(place);
            }
            return;
        };
        let count = tasks.len();
        let (mut slots, mut done) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for task in tasks {
            slots.push(Slot::new(task));
            done.push(OnceLock::new());
        }
        let act = |i: usize| {
            let (task, place): (T, &'a mut S) = slots[i].take();
            act(task, place);
            let place: &S = place;
            assert!(done[i].set(place).is_ok(), "a task ran twice");
        };
        let mut take = |i: usize| take(done[i].get().expect("its task has run"));
        pool.share_in_order(count, &act, &mut take);
    }
}

/// A task until a thread takes it.
struct Slot<T>(Mutex<Option<T>>);

impl<T> Slot<T> {
    fn new(task: T) -> Self {
        Self(Mutex::new(Some(task)))
    }

    fn take(&self) -> T {
        let task = self.0.lock().expect("nobody panics with the lock").take();
        task.expect("each task is taken once")
    }
}

/// Threads that wait for loops.
#[derive(Debug)]
struct Pool {
    threads: ThreadPool,
    calls: Arc<Calls>,
    /// Whether they share the loops of the present step.
    shares: AtomicBool,
    trial: Mutex<Trial>,
}

impl Pool {
    /// Runs `count` tasks on all threads, the caller's among them, and `rest` on each when it finds no more. Otherwise the
    /// caller would sleep, and to wake it costs as much as a small loop.
    ///
    /// It knows nothing of what a task is, so that it is compiled once and not for each of a hundred loops.
    fn share(
        &self,
        count: usize,
        act: &(dyn Fn(usize, usize) + Sync),
        rest: &(dyn Fn(usize) + Sync),
    ) {
        let threads = self.threads.current_num_threads() + 1;
        let begin = |thread: usize| count * thread / threads;
        let parts = (0..threads).map(|thread| Mutex::new(begin(thread)..begin(thread + 1)));
        let parts: Vec<_> = parts.collect();
        let part = |k: usize| parts[k].lock().expect("no task is made in a panic");
        let next = |thread: usize| {
            let own = part(thread).next();
            own.or_else(|| (0..threads).rev().find_map(|other| part(other).next_back()))
        };
        // The lock is released before the task is done.
        let work = |thread: usize| {
            while let Some(task) = next(thread) {
                act(task, thread);
            }
            rest(thread);
        };
        self.calls.lent.lend(&work, || {
            self.calls.call();
            work(CALLER);
        });
    }

    /// Runs `count` tasks, and calls `take` for every one in order, as soon as those up to it have run.
    fn share_in_order(
        &self,
        count: usize,
        act: &(dyn Fn(usize) + Sync),
        take: &mut (dyn FnMut(usize) + Send),
    ) {
        // By which thread each task was run.
        let done: Vec<OnceLock<usize>> = (0..count).map(|_| OnceLock::new()).collect();
        let (taken, taking) = (AtomicUsize::new(0), Mutex::new(take));
        // Takes the tasks that are next, as long as this thread has run them, or all of them.
        let take_next = |thread: Option<usize>| {
            // If another thread takes at present, it or the next one finds these too.
            let Ok(mut take) = taking.try_lock() else {
                return;
            };
            let mut next = taken.load(Ordering::Relaxed);
            while let Some(by) = done.get(next).and_then(OnceLock::get)
                && thread.is_none_or(|thread| thread == *by)
            {
                take(next);
                next += 1;
            }
            taken.store(next, Ordering::Release);
        };
        let run = |i: usize, thread: usize| {
            act(i);
            assert!(done[i].set(thread).is_ok(), "a task ran twice");
            take_next(Some(thread));
        };
        let rest = |thread: usize| {
            let last = done.iter().rposition(|by| by.get() == Some(&thread));
            within(LOOKS, || {
                take_next(Some(thread));
                last.is_none_or(|last| taken.load(Ordering::Acquire) > last)
            });
        };
        self.share(count, &run, &rest);
        take_next(None);
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.calls.ended.store(true, Ordering::Release);
        self.calls.call();
    }
}

/// What the threads of a pool look at while they wait.
#[derive(Debug, Default)]
struct Calls {
    /// Number of calls: one for each loop, and one at the end of the pool.
    count: AtomicUsize,
    /// The loop that runs.
    lent: Lent,
    ended: AtomicBool,
    /// Number of threads that sleep or are about to.
    sleepers: AtomicUsize,
    /// Held by a thread from its last look until it sleeps.
    last_look: Mutex<()>,
    woken: Condvar,
}

impl Calls {
    /// Calls all threads.
    fn call(&self) {
        // In this order, and in the opposite one in `next`, one of the two sees what the other has done.
        self.count.fetch_add(1, Ordering::SeqCst);
        if self.sleepers.load(Ordering::SeqCst) > 0 {
            drop(self.lock());
            self.woken.notify_all();
        }
    }

    /// A thread of the pool: runs its part of every loop until the pool ends.
    fn attend(&self, thread: usize) {
        let mut count = 0;
        loop {
            count = self.next(count);
            if self.ended.load(Ordering::Acquire) {
                return;
            }
            self.lent.join_in(thread);
        }
    }

    /// Waits until the number of calls is no longer `count`, and returns it.
    fn next(&self, count: usize) -> usize {
        let is_new = || self.count.load(Ordering::SeqCst) != count;
        if !within(LOOKS, is_new) {
            let mut last_look = self.lock();
            self.sleepers.fetch_add(1, Ordering::SeqCst);
            while !is_new() {
                last_look = (self.woken.wait(last_look)).unwrap_or_else(PoisonError::into_inner);
            }
            self.sleepers.fetch_sub(1, Ordering::SeqCst);
        }
        self.count.load(Ordering::SeqCst)
    }

    fn lock(&self) -> MutexGuard<'_, ()> {
        self.last_look
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    /// A sum that shows the order in which results were taken.
    fn ordered(threads: &Threads, count: usize) -> u64 {
        let mut places = vec![0; count];
        let mut sum = 1_u64;
        let tasks = (0..count).zip(&mut places);
        let act = |task: usize, place: &mut u64| *place = (task * task + 1) as u64;
        threads.in_order(tasks, act, |place| sum = sum.wrapping_mul(31) + place);
        sum
    }

    #[test]
    fn results_are_taken_in_the_order_of_the_tasks() {
        let alone = Threads::default();
        for count in [2, 3, 5] {
            let threads = Threads::new(count, "test").unwrap();
            assert_eq!(threads.count(), count);
            for tasks in [0, 1, 2, 7, 300] {
                for _ in 0..200 {
                    assert_eq!(ordered(&threads, tasks), ordered(&alone, tasks));
                }
            }
        }
    }

    #[test]
    fn every_task_runs_once_also_after_a_rest() {
        let threads = Threads::new(3, "test").unwrap();
        let mut runs = vec![0; 100];
        for rest in [0, 0, 5, 0, 20] {
            std::thread::sleep(Duration::from_millis(rest));
            threads.each(runs.iter_mut(), |run| *run += 1);
        }
        assert_eq!(runs, vec![5; 100]);
    }

    #[test]
    fn a_panic_in_a_task_reaches_the_caller() {
        let threads = Threads::new(2, "test").unwrap();
        let run = |bad: usize| {
            let act = |task| assert_ne!(task, bad, "a bad task");
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| threads.each(0..100, act)))
        };
        for bad in 0..100 {
            assert!(run(bad).is_err());
            assert!(run(1000).is_ok());
        }
    }

    #[test]
    fn threads_without_a_loop_sleep() {
        let threads = Threads::new(3, "test").unwrap();
        let calls = &threads.0.as_ref().unwrap().calls;
        for _ in 0..3 {
            threads.each(0..100, |_| {});
            let deadline = Instant::now() + Duration::from_secs(20);
            while calls.sleepers.load(Ordering::SeqCst) < 2 {
                assert!(Instant::now() < deadline, "they look for ever");
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }
}
