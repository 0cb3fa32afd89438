//! The number of sub-domains of a mesh.

use super::Options;

/// Most tetrahedra of a sub-domain where the number of sub-domains is automatic. All threads work within one, and a cut is work besides:
/// 9.3 million tetrahedra in four take 1.2 times the processor time of one, with plenty of memory, and 1.3 times within 128 MiB. Smaller
/// ones would be quicker to question and to saturate again, larger ones would not fit into the memory of a common machine.
pub const TETS_PER_SUBDOMAIN: f64 = (10u64 << 20) as f64;

/// Number of sub-domains for a mesh of `tets` tetrahedra, and the requested number if that is larger.
pub fn n_subdomains(tets: f64, options: &Options) -> (u32, Option<u32>) {
    let requested = options.mesh.subdomains.count();
    let auto = (tets / TETS_PER_SUBDOMAIN).ceil().max(1.0);
    let most = (tets / options.run.subdomain_tets_min()).floor().max(1.0);
    let wanted = requested.map_or(auto, f64::from);
    let n = wanted.min(most).min(f64::from(1u32 << 20)) as u32;
    (n, requested.filter(|_| wanted > most && wanted > 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subdomain_is_full_before_there_is_another() {
        let options = Options::default();
        for (shares, n) in [(0.0, 1), (0.6, 1), (1.0, 1), (1.1, 2), (10.0, 10), (48.5, 49)] {
            assert_eq!(n_subdomains(shares * TETS_PER_SUBDOMAIN, &options).0, n);
        }
    }
}
