//! A function that borrows, lent to threads that live on.
//!
//! A loop of a solver takes microseconds, and its tasks borrow the solver's data. Threads of the standard library borrow
//! only within a scope at whose end they end, and a scope of rayon takes 2.7 us. So the threads live on, and the function
//! is lent to them for the length of a call. The compiler cannot see that length, so one line is `unsafe`.

use std::any::Any;
use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Number of looks, some 50 us in all, for what another thread does, before a thread sleeps.
pub const LOOKS: usize = 2000;

/// Whether this is so at one of so many looks.
pub fn within(looks: usize, is_so: impl Fn() -> bool) -> bool {
    (0..looks).any(|_| {
        let so = is_so();
        if !so {
            spin_loop();
        }
        so
    })
}

/// What is lent: it takes the number of the thread that calls it.
type Work<'a> = dyn Fn(usize) + Sync + 'a;

/// A function that one thread lends to others, or none at present.
#[derive(Default)]
pub struct Lent {
    /// In a call of [`Self::lend`] alone. Threads count themselves as users while they hold the lock.
    work: Mutex<Option<&'static Work<'static>>>,
    /// Threads that run it.
    users: AtomicUsize,
    /// Whether the lender sleeps until there are none.
    sleeps: AtomicBool,
    unused: Condvar,
    /// What a user panicked with.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

impl core::fmt::Debug for Lent {
    fn fmt(&self, f: &mut core::fmt::Formatter) -> core::fmt::Result {
        f.debug_struct("Lent").finish_non_exhaustive()
    }
}

impl Lent {
    /// Lends `work` while `own` runs, and returns when no thread runs it any more. If something is lent already, by another thread
    /// or further up, `own` runs and nothing else is lent.
    ///
    /// # Panics
    /// As `own` or a call of `work` did.
    pub fn lend(&self, work: &Work, own: impl FnOnce()) {
        {
            let mut slot = lock(&self.work);
            if slot.is_some() {
                drop(slot);
                return own();
            }
            // SAFETY: No thread calls `work` after its lifetime. Threads take it out of the slot in `join_in` alone, where
            // they become users under the lock. `Loan` empties the slot and waits until there are no users, before this
            // function returns or unwinds, so while the reference it was given is valid.
            #[expect(unsafe_code)]
            let forever = unsafe { core::mem::transmute::<&Work, &'static Work<'static>>(work) };
            *slot = Some(forever);
        }
        *lock(&self.panic) = None; // one of a loan whose lender panicked too
        let loan = Loan(self);
        own();
        drop(loan);
        let panic = lock(&self.panic).take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }

    /// Calls what is lent at present, if anything is, as thread number `thread`.
    pub fn join_in(&self, thread: usize) {
        let work = {
            let slot = lock(&self.work);
            let Some(work) = *slot else { return };
            self.users.fetch_add(1, Ordering::SeqCst);
            work
        };
        // The function is shared with the lender, to whom the panic is passed on.
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| work(thread))) {
            *lock(&self.panic) = Some(panic);
        }
        // In this order, and in the opposite one in `Loan`, one of the two sees what the other has done.
        self.users.fetch_sub(1, Ordering::SeqCst);
        if self.sleeps.load(Ordering::SeqCst) {
            drop(lock(&self.work));
            self.unused.notify_all();
        }
    }
}

/// Ends with the loan.
struct Loan<'a>(&'a Lent);

impl Drop for Loan<'_> {
    fn drop(&mut self) {
        let lent = self.0;
        *lock(&lent.work) = None;
        let used = || lent.users.load(Ordering::SeqCst) > 0;
        if within(LOOKS, || !used()) {
            return;
        }
        let mut slot = lock(&lent.work);
        lent.sleeps.store(true, Ordering::SeqCst);
        while used() {
            slot = (lent.unused.wait(slot)).unwrap_or_else(PoisonError::into_inner);
        }
        lent.sleeps.store(false, Ordering::SeqCst);
    }
}

/// Nothing panics while it holds a lock here.
fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::thread::{sleep, spawn};
    use std::time::Duration;

    use super::*;

    /// Threads that join in until they are told to stop.
    fn with_threads(count: usize, act: impl FnOnce(&Lent)) {
        let lent = Arc::new(Lent::default());
        let stop = Arc::new(AtomicBool::new(false));
        let joined = (0..count).map(|i| {
            let (lent, stop) = (Arc::clone(&lent), Arc::clone(&stop));
            spawn(move || {
                while !stop.load(Ordering::Acquire) {
                    lent.join_in(i + 1);
                    spin_loop();
                }
            })
        });
        let joined: Vec<_> = joined.collect();
        act(&lent);
        stop.store(true, Ordering::Release);
        for thread in joined {
            thread.join().expect("no panic of a loan ends a thread");
        }
    }

    /// What is lent borrows from the lender's stack; each time it is gone when `lend` returns, also where the last user is
    /// slow.
    #[test]
    fn nobody_uses_a_loan_that_has_ended() {
        with_threads(3, |lent| {
            for round in 0..2000 {
                let running = AtomicUsize::new(0);
                let work = |_: usize| {
                    running.fetch_add(1, Ordering::SeqCst);
                    if round % 500 == 0 {
                        sleep(Duration::from_millis(5));
                    }
                    running.fetch_sub(1, Ordering::SeqCst);
                };
                lent.lend(&work, || work(0));
                assert_eq!(running.load(Ordering::SeqCst), 0);
                assert!(lock(&lent.work).is_none());
            }
        });
    }

    #[test]
    fn others_join_in() {
        with_threads(1, |lent| {
            let called = AtomicUsize::new(0);
            let work = |thread: usize| {
                called.fetch_max(thread, Ordering::SeqCst);
            };
            lent.lend(&work, || {
                while called.load(Ordering::SeqCst) == 0 {
                    spin_loop();
                }
            });
            assert_eq!(called.load(Ordering::SeqCst), 1);
        });
    }

    /// A panic of the lender still waits for the users, one of a user reaches the lender, and both leave it fit for the next.
    #[test]
    fn panics_end_a_loan() {
        with_threads(1, |lent| {
            for [by_user, by_lender] in [[true, false], [false, true], [true, true]].repeat(50) {
                let began = AtomicBool::new(false);
                let running = AtomicUsize::new(0);
                let work = |_: usize| {
                    running.fetch_add(1, Ordering::SeqCst);
                    began.store(true, Ordering::SeqCst);
                    running.fetch_sub(1, Ordering::SeqCst);
                    assert!(!by_user, "of the user");
                };
                let own = || {
                    while !began.load(Ordering::SeqCst) {
                        spin_loop();
                    }
                    assert!(!by_lender, "of the lender");
                };
                let lends = AssertUnwindSafe(|| lent.lend(&work, own));
                let panic = catch_unwind(lends).expect_err("one of them");
                let of = if by_lender {
                    "of the lender"
                } else {
                    "of the user"
                };
                assert_eq!(panic.downcast_ref(), Some(&of));
                assert_eq!(running.load(Ordering::SeqCst), 0);
                lent.lend(&|_| {}, || {});
            }
        });
    }

    #[test]
    fn a_loan_within_a_loan_is_not_lent() {
        with_threads(2, |lent| {
            let ran = AtomicUsize::new(0);
            lent.lend(&|_| {}, || {
                let inner = |_: usize| unreachable!("it is not lent");
                lent.lend(&inner, || {
                    ran.fetch_add(1, Ordering::SeqCst);
                });
            });
            assert_eq!(ran.load(Ordering::SeqCst), 1);
        });
    }
}
