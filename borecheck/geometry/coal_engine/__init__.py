"""Coal's trees and narrowphase; the only place that imports coal."""
