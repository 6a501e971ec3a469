"""A server for programs: operations, runs and analyses of the netlists of one folder by the Model Context Protocol."""
