//! Which clause is judged next, where several are judged at once.
//!
//! A clause is begun when all those are judged that it is after, so what it is blocked by does not depend on how many
//! are judged at once. One that measures time is judged while no other is.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::clause::Clause;
use crate::verdict::Verdict;

/// A clause and its place in the table.
pub type Place = (usize, &'static Clause);

/// What to do next.
pub enum Next {
    /// Judge this one.
    Judge(Place),
    /// Take note that this one cannot be judged, because of another one.
    Blocked(Place, &'static str),
    /// Wait until another one is judged.
    Wait,
    /// None is left.
    Over,
}

/// What is known of a clause.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    Nothing,
    /// Nothing rests on it in vain.
    Judged,
    /// What rests on it is blocked by this one.
    Broken(&'static str),
}

/// The clauses that are still to be judged, and what is known of the others.
pub struct Queue {
    /// In the order in which they are begun.
    waiting: Vec<Place>,
    /// All that are asked for.
    asked: BTreeMap<&'static str, Known>,
    /// What the first clause asks for, that a solver comes and says Hello, every other one needs.
    first: Option<&'static str>,
    running: usize,
    one_is_alone: bool,
}

impl Queue {
    /// These clauses of a table whose first one is `first`.
    pub fn new(first: Option<&'static str>, clauses: &[&'static Clause]) -> Self {
        let mut waiting: Vec<Place> = clauses.iter().copied().enumerate().collect();
        // Clauses that are tested alone come early. If they came late, all would wait for the slowest before them.
        let mut early: BTreeSet<&str> = first.into_iter().collect();
        for clause in clauses.iter().rev() {
            if clause.alone || early.contains(clause.id) {
                early.insert(clause.id);
                early.extend(clause.after);
            }
        }
        waiting.sort_by_key(|(place, clause)| (!early.contains(clause.id), *place));
        Self {
            waiting,
            asked: clauses
                .iter()
                .map(|clause| (clause.id, Known::Nothing))
                .collect(),
            first,
            running: 0,
            one_is_alone: false,
        }
    }

    /// What this clause needs and is judged too, with what is known of it.
    fn needs(&self, clause: &Clause) -> impl Iterator<Item = Known> {
        let needs = self.first.iter().chain(clause.after);
        let needs = needs.filter(|id| **id != clause.id);
        needs.filter_map(|id| self.asked.get(id).copied())
    }

    /// What to do next. A thread that tests a clause calls [`Self::judged`] at the end.
    pub fn next(&mut self) -> Next {
        if self.waiting.is_empty() {
            return Next::Over;
        }
        if self.one_is_alone {
            return Next::Wait;
        }
        for k in 0..self.waiting.len() {
            let (place, clause) = self.waiting[k];
            if clause.alone && self.running > 0 {
                return Next::Wait;
            }
            if self.needs(clause).any(|known| known == Known::Nothing) {
                continue;
            }
            let by = self.needs(clause).find_map(|known| match known {
                Known::Broken(by) => Some(by),
                _ => None,
            });
            self.waiting.remove(k);
            if let Some(by) = by {
                self.asked.insert(clause.id, Known::Broken(by));
                return Next::Blocked((place, clause), by);
            }
            self.running += 1;
            self.one_is_alone = clause.alone;
            return Next::Judge((place, clause));
        }
        Next::Wait
    }

    /// Takes note of a verdict.
    pub fn judged(&mut self, clause: &Clause, verdict: &Verdict) {
        let known = match verdict {
            Verdict::Fail(_) => Known::Broken(clause.id),
            _ => Known::Judged,
        };
        self.asked.insert(clause.id, known);
        self.running -= 1;
        self.one_is_alone = false;
    }
}

/// A queue that several threads take from.
pub struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

/// Where a thread that judges has ended in a panic, the others find nothing left to do.
struct Watch<'a>(&'a Shared);

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.lock().waiting.clear();
            self.0.changed.notify_all();
        }
    }
}

impl Shared {
    /// Shares a queue.
    pub fn new(queue: Queue) -> Self {
        Self {
            queue: Mutex::new(queue),
            changed: Condvar::new(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tests clauses with `judge` until none is left. Calls `tell` with each verdict, also of blocked clauses.
    pub fn work<J>(
        &self,
        judge: impl Fn(&'static Clause) -> J,
        verdict: impl Fn(&J) -> &Verdict,
        blocked: impl Fn(&'static Clause, &'static str) -> J,
        tell: impl Fn(usize, J),
    ) {
        let _watch = Watch(self);
        loop {
            let mut queue = self.lock();
            match queue.next() {
                Next::Judge((place, clause)) => {
                    drop(queue);
                    let judged = judge(clause);
                    self.lock().judged(clause, verdict(&judged));
                    self.changed.notify_all();
                    tell(place, judged);
                }
                Next::Blocked((place, clause), by) => {
                    drop(queue);
                    self.changed.notify_all();
                    tell(place, blocked(clause, by));
                }
                Next::Wait => {
                    let queue = self.changed.wait(queue);
                    drop(queue.unwrap_or_else(PoisonError::into_inner));
                }
                Next::Over => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdict::{Unmet, broken};

    const fn row(id: &'static str, after: &'static [&'static str]) -> Clause {
        Clause::must(id, "", |_| Ok(String::new())).after(after)
    }

    static ROWS: [Clause; 6] = [
        row("first", &[]),
        row("slow", &[]),
        row("base", &[]),
        row("timed", &["base"]).alone(),
        row("upper", &["slow", "base"]),
        row("other", &[]),
    ];

    fn queue() -> Queue {
        Queue::new(Some("first"), &ROWS.each_ref())
    }

    fn begun(queue: &mut Queue) -> &'static str {
        match queue.next() {
            Next::Judge((_, clause)) => clause.id,
            Next::Blocked((_, clause), by) => {
                assert!(ROWS.iter().any(|row| row.id == by));
                clause.id
            }
            Next::Wait => "wait",
            Next::Over => "over",
        }
    }

    fn row_of(id: &str) -> &'static Clause {
        ROWS.iter().find(|row| row.id == id).unwrap()
    }

    fn kept() -> Verdict {
        Verdict::Pass {
            measured: String::new(),
        }
    }

    #[test]
    fn all_wait_for_the_first_and_for_one_that_is_alone() {
        let mut queue = queue();
        assert_eq!([begun(&mut queue), begun(&mut queue)], ["first", "wait"]);
        queue.judged(row_of("first"), &kept());
        // A clause that is tested alone waits for the clauses that it needs, and others wait for it.
        assert_eq!([begun(&mut queue), begun(&mut queue)], ["base", "wait"]);
        queue.judged(row_of("base"), &kept());
        assert_eq!([begun(&mut queue), begun(&mut queue)], ["timed", "wait"]);
        queue.judged(row_of("timed"), &kept());
        let next = [(); 3].map(|()| begun(&mut queue));
        assert_eq!(next, ["slow", "other", "wait"]);
        queue.judged(row_of("slow"), &kept());
        assert_eq!([begun(&mut queue), begun(&mut queue)], ["upper", "over"]);
    }

    #[test]
    fn what_a_broken_one_blocks_is_not_judged() {
        let mut queue = queue();
        let failed = |unmet: Unmet| Verdict::from(unmet);
        begun(&mut queue);
        queue.judged(row_of("first"), &failed(broken("", "")));
        for row in &ROWS[1..] {
            let Next::Blocked((place, clause), by) = queue.next() else {
                panic!("{} is judged", row.id);
            };
            assert_eq!((ROWS[place].id, by), (clause.id, "first"));
        }
        assert_eq!(begun(&mut queue), "over");
    }

    #[test]
    fn several_threads_judge_each_clause_once_and_end_where_one_panics() {
        let told = Mutex::new(Vec::new());
        let shared = Shared::new(queue());
        let work = |judge: fn(&'static Clause) -> Verdict| {
            shared.work(
                judge,
                |verdict| verdict,
                |_, by| Verdict::Blocked { by },
                |place, _| told.lock().unwrap().push(place),
            );
        };
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| work(|_| kept()));
            }
        });
        let mut places = told.lock().unwrap().clone();
        places.sort_unstable();
        assert_eq!(places, [0, 1, 2, 3, 4, 5]);

        let shared = Shared::new(queue());
        let panics = |_| panic!("a fault of the kit");
        let work = || {
            shared.work(
                panics,
                |verdict| verdict,
                |_, by| Verdict::Blocked { by },
                |_, _| (),
            );
        };
        let ended = std::thread::scope(|scope| {
            [(); 2]
                .map(|()| scope.spawn(work))
                .map(|one| one.join().is_err())
        });
        assert!(ended.contains(&true));
    }
}
