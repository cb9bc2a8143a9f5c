// Does nothing: the headers that tests, replays and examples share belong to a program, see CMakeLists.txt.
int main() {}
