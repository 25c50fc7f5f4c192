//! Data directories that earlier releases wrote.

use std::fs;
use std::io::Read;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// A file next to the directory that `release` wrote.
pub fn golden(release: &str, name: &str) -> PathBuf {
    crate::paths::root().join("tests/golden").join(release).join(name)
}

/// A directory that `release` wrote, unpacked. The archive is `data` or has another name.
pub fn released(release: &str, archive: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let packed = fs::File::open(golden(release, &format!("{archive}.tar.gz"))).unwrap();
    let mut tar = Vec::new();
    flate2::read::GzDecoder::new(packed).read_to_end(&mut tar).unwrap();
    unpack(&tar, dir.path());
    dir
}

/// Unpacks a ustar archive of directories and small files.
fn unpack(tar: &[u8], into: &Path) {
    let text = |bytes: &[u8]| {
        let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
        String::from_utf8(bytes[..end].to_vec()).unwrap()
    };
    let octal = |bytes: &[u8]| u64::from_str_radix(text(bytes).trim(), 8).unwrap();
    let mut rest = tar;
    while rest[0] != 0 {
        let (header, after) = rest.split_at(512);
        let path = into.join(text(&header[..100]));
        let length = octal(&header[124..136]) as usize;
        match header[156] {
            b'5' => fs::create_dir_all(&path).unwrap(),
            b'0' => fs::write(&path, &after[..length]).unwrap(),
            kind => panic!("{} has kind {kind}", path.display()),
        }
        let mode = octal(&header[100..108]) as u32;
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        rest = &after[length.div_ceil(512) * 512..];
    }
}
