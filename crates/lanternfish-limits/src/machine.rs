//! Memory of the machine and of this process. All functions return `None` on systems other than Linux.

use std::{fs, path::Path};

/// Bytes that this process can still allocate: the least of the available memory and the rest of its control group and address space.
pub fn free() -> Option<u64> {
    let available = kibibytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")?;
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let of_group = in_group(Path::new("/sys/fs/cgroup"), &groups);
    Some([of_group, address_space()].into_iter().flatten().fold(available, u64::min))
}

/// Resident memory of this process, bytes.
pub fn used() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmRSS:")
}

/// Bytes left of a limited address space; `None` if it is unlimited.
fn address_space() -> Option<u64> {
    let most = most_addresses(&fs::read_to_string("/proc/self/limits").ok()?)?;
    Some(most.saturating_sub(kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmSize:")?))
}

/// Soft limit of the address space, bytes, from the text of `/proc/self/limits`; `None`: unlimited.
fn most_addresses(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Bytes of the line `name:   123 kB`.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Bytes left of the control groups that `/proc/self/cgroup` names, or of those that a container sees. The page cache of files
/// on disk counts as free, since the kernel reclaims it. Files in memory (`shmem`, which `file` includes) do not.
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
        // A group's limit applies to all its descendants.
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
        let left = |groups: &str| in_group(folder.path(), groups);
        assert_eq!(left("0::/a/b\n"), None);
        write("a/b/memory.max", "max\n");
        write("a/b/memory.current", "50\n");
        assert_eq!(left("0::/a/b\n"), None, "max is no limit");
        write("a/memory.max", "1000\n");
        write("a/memory.current", "700\n");
        write("a/memory.stat", "anon 5\nfile 500\nshmem 300\nfile_mapped 99\ninactive_file 50\nactive_file 150\n");
        assert_eq!(left("0::/a/b\n"), Some(500));
        // Version 1 has one hierarchy per controller; in a container the root is the group.
        write("memory/memory.limit_in_bytes", "900\n");
        write("memory/memory.usage_in_bytes", "600\n");
        assert_eq!(left("3:cpuset:/\n4:memory:/not/seen/here\n"), Some(300));
        assert_eq!(left("0::/a/b\n4:memory:/x\n"), Some(300));
    }
}
