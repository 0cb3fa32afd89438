//! The number of sub-domains of a mesh.

use super::Options;

/// Most tetrahedra of a sub-domain where an automatic number of sub-domains is two or more. Cuts are expensive: 21 million
/// tetrahedra in ten sub-domains take a tenth to a fifth longer than in four, with caps from 128 MiB on. The first cut runs
/// alone, however many follow.
const TETS_PER_SUBDOMAIN: f64 = (5u64 << 20) as f64;
/// Like `TETS_PER_SUBDOMAIN`, for a mesh so large that it has [`MANY`] sub-domains in any case. 41 million tetrahedra take less
/// time in four sub-domains than in ten, within 1 GiB too.
const TETS_PER_SUBDOMAIN_MAX: f64 = 2.0 * TETS_PER_SUBDOMAIN;
/// Most tetrahedra of a mesh that stays in one sub-domain by default. Two threads are faster on two sub-domains than within one.
const TETS_ALONE: f64 = (2u64 << 20) as f64;
/// Number of sub-domains from which on threads and machines have enough of them to share.
const MANY: f64 = 32.0;

/// Number of sub-domains for a mesh of `tets` tetrahedra, and the requested number if that is larger.
pub fn n_subdomains(tets: f64, options: &Options) -> (u32, Option<u32>) {
    let requested = options.mesh.subdomains.count();
    let each = (tets / MANY).clamp(TETS_PER_SUBDOMAIN, TETS_PER_SUBDOMAIN_MAX);
    // The number is even: three sub-domains take longer on two threads than two or four.
    let auto = match tets > TETS_ALONE {
        true => 2.0 * (0.5 * tets / each).ceil(),
        false => 1.0,
    };
    let most = (tets / options.run.subdomain_tets_min()).floor().max(1.0);
    let wanted = requested.map_or(auto, f64::from);
    let n = wanted.min(most).min(f64::from(1u32 << 20)) as u32;
    (n, requested.filter(|_| wanted > most && wanted > 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_mesh_has_fewer_subdomains_for_its_size() {
        let options = Options::default();
        // From 32 sub-domains on they grow to twice the size, then their number grows.
        let shares = [(0.6, 2), (2.0, 2), (2.1, 4), (10.0, 10), (32.0, 32), (48.0, 32)];
        for (shares, n) in shares.into_iter().chain([(500.0, 250)]) {
            assert_eq!(n_subdomains(shares * TETS_PER_SUBDOMAIN, &options).0, n);
        }
        assert_eq!(n_subdomains(TETS_ALONE, &options).0, 1);
        assert_eq!(n_subdomains(1.01 * TETS_ALONE, &options).0, 2);
    }
}
