//! Memory of the machine; `None` on systems other than Linux.

use std::{fs, path::Path};

/// Bytes that this process may still take: available memory, or what is left of its control group or its address space.
pub fn free() -> Option<u64> {
    let available = kibibytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")?;
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let of_group = in_group(Path::new("/sys/fs/cgroup"), &groups);
    Some([of_group, address_space()].into_iter().flatten().fold(available, u64::min))
}

/// Bytes of memory that this process holds.
pub fn used() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmRSS:")
}

/// What is left of a limited address space.
fn address_space() -> Option<u64> {
    let most = most_addresses(&fs::read_to_string("/proc/self/limits").ok()?)?;
    Some(most.saturating_sub(kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmSize:")?))
}

/// The soft limit of the table of limits; `None`: unlimited.
fn most_addresses(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// `name:   123 kB`, in bytes.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// What is left of the control groups that `/proc/self/cgroup` names, or of all that a container sees of them. Pages of files
/// on a disk count as left: they are given back when memory is short. Files in memory (`shmem`, which `file` includes) are not.
fn in_group(root: &Path, groups: &str) -> Option<u64> {
    let number = |path: &Path| fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let left = |folder: &Path, most: &str, used: &str, pages: &[&str]| {
        let most = number(&folder.join(most))?;
        let stat = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let pages_of = |line: &str| pages.iter().find_map(|name| line.strip_prefix(name)?.trim().parse::<u64>().ok());
        let pages = stat.lines().filter_map(pages_of).sum();
        Some(most.saturating_sub(number(&folder.join(used))?.saturating_sub(pages)))
    };
    let of_line = |line: &str| {
        let (_, rest) = line.split_once(':')?;
        let (controllers, path) = rest.split_once(':')?;
        let (root, most, used, pages): (_, _, _, &[_]) = match controllers {
            "" => (root.to_owned(), "memory.max", "memory.current", &["active_file ", "inactive_file "]),
            "memory" => {
                let names = ("memory.limit_in_bytes", "memory.usage_in_bytes");
                (root.join("memory"), names.0, names.1, &["total_inactive_file "])
            }
            _ => return None,
        };
        // A group's limit holds for all below it.
        let own = root.join(path.trim_start_matches('/'));
        let above = own.ancestors().take_while(|folder| folder.starts_with(&root));
        above.filter_map(|folder| left(folder, most, used, pages)).min()
    };
    groups.lines().filter_map(of_line).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_the_kernel_are_read() {
        assert_eq!(kibibytes("MemTotal: 9 kB\nMemAvailable:   12 kB\n", "MemAvailable:"), Some(12_288));
        assert_eq!(kibibytes("MemTotal: 9 kB\n", "MemAvailable:"), None);
        let limits = |soft: &str| {
            format!("Limit  Soft Limit  Hard Limit  Units\nMax address space   {soft}  unlimited  bytes\n")
        };
        assert_eq!(most_addresses(&limits("4096")), Some(4096));
        assert_eq!(most_addresses(&limits("unlimited")), None);
    }

    #[test]
    fn the_tightest_group_counts() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        let room = |groups: &str| in_group(folder.path(), groups);
        assert_eq!(room("0::/a/b\n"), None);
        write("a/b/memory.max", "max\n");
        write("a/b/memory.current", "50\n");
        assert_eq!(room("0::/a/b\n"), None, "max is no limit");
        write("a/memory.max", "1000\n");
        write("a/memory.current", "700\n");
        write("a/memory.stat", "anon 5\nfile 500\nshmem 300\nfile_mapped 99\ninactive_file 50\nactive_file 150\n");
        assert_eq!(room("0::/a/b\n"), Some(500));
        // The first version of groups: one a controller, and in a container the root is the group.
        write("memory/memory.limit_in_bytes", "900\n");
        write("memory/memory.usage_in_bytes", "600\n");
        assert_eq!(room("3:cpuset:/\n4:memory:/not/seen/here\n"), Some(300));
        assert_eq!(room("0::/a/b\n4:memory:/x\n"), Some(300));
    }
}
