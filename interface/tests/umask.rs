//! A separate program, since a umask applies to the whole process.

use std::os::unix::fs::PermissionsExt;

use interface::transport::domain::OwnedDomain;
use rustix::fs::Mode;
use rustix::process::umask;

/// iceoryx2 sets a umask of 0177 while it binds a socket. A directory that another thread made at that time could not
/// be entered.
#[test]
fn a_run_belongs_to_its_owner_whatever_the_umask() {
    let before = umask(Mode::from_raw_mode(0o177));
    let owned = OwnedDomain::create();
    umask(before);
    let owned = owned.unwrap();
    let mode = owned.domain().directory().metadata().unwrap();
    assert_eq!(mode.permissions().mode() & 0o777, 0o700);
}
