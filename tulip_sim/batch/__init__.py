"""Many trials over seeds and parameter sets, on all cores or on a cluster; a batch that was stopped goes on."""
